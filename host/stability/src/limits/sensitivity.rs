//! Derivatives of a limit with respect to parameters of the delay problem, from one Floquet mode and its adjoint.
//!
//! At a crossing of the unit circle by a Floquet multiplier, F = lᵀ(Φ(κ; p) − μ)r = 0 with the transition matrix Φ over
//! the tooth period, its left and right eigenvectors l and r, the complex depth κ = w (1 − 1/μ), and μ = e^{iθ}. Along
//! a change dp of a parameter
//!
//!   lᵀΦ_κ r [(1 − 1/μ) dw + (w/μ) i dθ] + lᵀΦ_p r dp − iμ lᵀr dθ = 0,
//!
//! which are two real equations for dw and dθ. At a flip μ stays −1, and the real part alone determines dw. lᵀ dΦ r = ∫
//! yᵀ dG x dt is a quadrature over the Floquet mode and its adjoint, [`FloquetMode`].

use nalgebra::{DMatrix, Matrix3, Vector3};
use num_complex::Complex64;

use super::speed_line::Switch;
use crate::error::StabilityError;
use crate::problem::linear::Problem;
use crate::spectrum::floquet_mode::{FloquetMode, Node};
use quietcut_model::milling::{RotatingVector, ToothForce};
use quietcut_model::structure::{FirstOrder, ModalPart};

/// Derivative of the linear delay problem along one parameter, per unit of the parameter.
#[derive(Clone, Debug)]
pub struct Tangent {
    /// Derivative of the structure's matrices A, B and C, in feed, normal and axial direction; `None` stands for zero.
    structure: Option<FirstOrder>,
    /// Derivative of a tooth's force direction (`cutting`), chip normal (`normal`) and edge force (`edge`); `None`
    /// stands for zero.
    force: Option<ToothForce>,
    feed_per_tooth_m: f64,
    start: f64,
    exit: f64,
}

impl Tangent {
    const NONE: Self = Self {
        structure: None,
        force: None,
        feed_per_tooth_m: 0.0,
        start: 0.0,
        exit: 0.0,
    };

    /// Derivative of the delay problem per rad/s of the natural frequency of a mode, at constant damping ratio and mode
    /// shape.
    pub fn omega(problem: &Problem, mode: &ModalPart) -> Self {
        Self::of_flow(problem, mode.by_omega())
    }

    /// Derivative of the delay problem per unit of the damping ratio of a mode, at constant frequency and mode shape.
    pub fn damping_ratio(problem: &Problem, mode: &ModalPart) -> Self {
        Self::of_flow(problem, mode.by_damping_ratio())
    }

    /// Derivative of the delay problem per relative change of K_tc, with constant ratios K_rc/K_tc and K_ac/K_tc and
    /// constant edge coefficients.
    pub fn cutting_force(problem: &Problem) -> Self {
        let zero = RotatingVector {
            constant: Vector3::zeros(),
            cosine: Vector3::zeros(),
            sine: Vector3::zeros(),
        };
        Self {
            force: Some(ToothForce {
                cutting: problem.process.force.cutting,
                normal: zero,
                edge: zero,
            }),
            ..Self::NONE
        }
    }

    /// Difference quotient between two problems that differ by `length` units of the parameter, with equal numbers of
    /// teeth and states. It is a central difference if the point of differentiation is half way between the two.
    pub fn between(low: &Problem, high: &Problem, length: f64) -> Self {
        let (p, q) = (&low.structure, &high.structure);
        let (f, g) = (&low.process, &high.process);
        Self {
            structure: Some(FirstOrder {
                a: (&q.a - &p.a) / length,
                b: (&q.b - &p.b) / length,
                c: (&q.c - &p.c) / length,
            }),
            force: Some(ToothForce {
                cutting: slope(&f.force.cutting, &g.force.cutting, length),
                normal: slope(&f.force.normal, &g.force.normal, length),
                edge: slope(&f.force.edge, &g.force.edge, length),
            }),
            feed_per_tooth_m: (g.feed_per_tooth_m - f.feed_per_tooth_m) / length,
            start: (g.engagement.start - f.engagement.start) / length,
            exit: (g.engagement.exit - f.engagement.exit) / length,
        }
    }

    fn of_flow(problem: &Problem, a: DMatrix<f64>) -> Self {
        let mut structure = problem.structure.clone();
        structure.a = a;
        structure.b.fill(0.0);
        structure.c.fill(0.0);
        Self {
            structure: Some(structure),
            ..Self::NONE
        }
    }
}

fn slope(low: &RotatingVector, high: &RotatingVector, length: f64) -> RotatingVector {
    RotatingVector {
        constant: (high.constant - low.constant) / length,
        cosine: (high.cosine - low.cosine) / length,
        sine: (high.sine - low.sine) / length,
    }
}

/// Derivatives of depth and angle of a crossing of the unit circle by a multiplier, per unit of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// Derivative dw/dp of the axial depth w of the crossing, mm per unit of the parameter p.
    pub depth_mm: f64,
    /// Derivative dθ/dp of the angle θ of the multiplier e^{iθ} at the crossing, rad per unit of the parameter p; 0 at
    /// a flip.
    pub angle: f64,
}

/// Crossing of the unit circle by a multiplier, with the quantities that the derivatives of its depth need.
#[derive(Clone, Debug)]
pub struct Sensitivity<'a> {
    problem: &'a Problem,
    seconds_per_radian: f64,
    kappa: Complex64,
    depth_m: f64,
    multiplier: Complex64,
    motion: FloquetMode,
    /// Coefficient lᵀΦ_κ r, 1/m: derivative of the transition matrix Φ over the complex depth κ, between the left and
    /// right eigenvectors l and r.
    by_kappa: Complex64,
}

impl<'a> Sensitivity<'a> {
    /// Prepares the derivatives of one of the stability switches found by [`line`](crate::line()).
    ///
    /// # Errors
    /// The switch is a fold, or a Hopf switch without a chatter frequency, or its Floquet mode cannot be computed. A
    /// switch of another problem is not detected.
    pub fn new(problem: &'a Problem, rpm: f64, switch: &Switch) -> Result<Self, StabilityError> {
        let broke_down = || StabilityError::BrokeDown {
            rpm,
            depth_mm: switch.depth_mm,
            what: "no motion belongs to this limit",
        };
        // A fold has μ = 1 and κ = w (1 − 1/μ) = 0: the depth has no influence, so that no such limit exists. A Hopf
        // switch without a chatter frequency does not give the multiplier.
        let multiplier = switch
            .multiplier(problem.tooth_period_s(rpm))
            .ok_or_else(broke_down)?;
        Self::of_crossing(problem, rpm, switch.depth_mm * 1e-3, multiplier).ok_or_else(broke_down)
    }

    fn of_crossing(problem: &'a Problem, rpm: f64, depth_m: f64, multiplier: Complex64) -> Option<Self> {
        let motion = FloquetMode::new(problem, rpm, depth_m, multiplier)?;
        let mut sensitivity = Self {
            problem,
            seconds_per_radian: problem.tooth_period_s(rpm) / problem.process.engagement.pitch,
            kappa: (Complex64::ONE - multiplier.inv()) * depth_m,
            depth_m,
            multiplier,
            motion,
            by_kappa: Complex64::ZERO,
        };
        sensitivity.by_kappa = sensitivity.along(|node| {
            let (seen, pushed) = sensitivity.ends(node);
            bilinear(&pushed, &sensitivity.directional(node), &seen)
        });
        Some(sensitivity)
    }

    /// Derivatives of the crossing of the unit circle along a change of the delay problem.
    ///
    /// `None` if the depth is not differentiable in the parameter: at the tip of an island.
    pub fn slope(&self, tangent: &Tangent) -> Option<Slope> {
        let by_parameter = self.by_parameter(tangent);
        let mu = self.multiplier;
        let by_depth = self.by_kappa * (Complex64::ONE - mu.inv());
        let by_angle = if mu.im == 0.0 {
            // At a flip μ stays real. The equation for dw and dθ is then real except for the coefficient of dθ, so that
            // dθ = 0.
            None
        } else {
            let turning = self.by_kappa * self.depth_m / mu - mu * self.motion.overlap;
            Some(turning * Complex64::I)
        };
        let slope = match by_angle {
            None => Slope {
                depth_mm: -1e3 * (by_parameter / by_depth).re,
                angle: 0.0,
            },
            Some(by_angle) => {
                let determinant = by_depth.re * by_angle.im - by_depth.im * by_angle.re;
                let p = by_parameter;
                Slope {
                    depth_mm: -1e3 * (p.re * by_angle.im - p.im * by_angle.re) / determinant,
                    angle: -(by_depth.re * p.im - by_depth.im * p.re) / determinant,
                }
            }
        };
        (slope.depth_mm.is_finite() && slope.angle.is_finite()).then_some(slope)
    }

    /// Integral of a function of Floquet mode and adjoint over the tooth period.
    fn along(&self, integrand: impl Fn(&Node) -> Complex64) -> Complex64 {
        let nodes = &self.motion.nodes;
        nodes.iter().map(|node| integrand(node) * node.weight_s).sum()
    }

    /// Displacement C x of the Floquet mode and vector Bᵀ y of its adjoint at a node.
    fn ends(&self, node: &Node) -> (Vector3<Complex64>, Vector3<Complex64>) {
        let structure = &self.problem.structure;
        let seen = structure.c.map(Complex64::from) * &node.right;
        let pushed = structure.b.map(Complex64::from).transpose() * &node.left;
        (seen, pushed)
    }

    fn angles(&self, node: &Node) -> impl Iterator<Item = f64> {
        let engagement = self.problem.process.engagement;
        let phase = node.phase;
        (0..node.teeth).map(move |tooth| engagement.angle(tooth, phase))
    }

    /// Sum of cutting·normalᵀ (force direction times chip normal) over the teeth that cut at a node.
    fn directional(&self, node: &Node) -> Matrix3<f64> {
        let force = &self.problem.process.force;
        self.angles(node).map(|angle| force.directional(angle)).sum()
    }

    /// Force per displacement of one tooth at an immersion angle, M = κ cutting·normalᵀ − β, N/m, with the complex
    /// depth κ.
    fn of_tooth(&self, angle: f64) -> Matrix3<Complex64> {
        let process = &self.problem.process;
        let mut coupling = process.force.directional(angle).map(|entry| self.kappa * entry);
        if process.axial_depth_modulation {
            let forced = process.force.forced(angle, process.feed_per_tooth_m);
            for i in 0..3 {
                coupling[(i, 2)] -= forced[i];
            }
        }
        coupling
    }

    /// Coefficient lᵀΦ_p r: derivative of the transition matrix Φ along the parameter p, between the left and right
    /// eigenvectors l and r.
    fn by_parameter(&self, tangent: &Tangent) -> Complex64 {
        let mut sum = self.along(|node| self.integrand(tangent, node));
        // A later entry angle removes the force of a tooth at the start angle; a later exit angle adds that of a tooth
        // at the exit angle.
        let engagement = &self.problem.process.engagement;
        for (node, angle, later) in [
            (&self.motion.entry, engagement.start, -tangent.start),
            (&self.motion.exit, engagement.exit, tangent.exit),
        ] {
            if later != 0.0 {
                let (seen, pushed) = self.ends(node);
                let coupling = self.of_tooth(angle);
                sum += (pushed.transpose() * coupling * seen)[(0, 0)] * (later * self.seconds_per_radian);
            }
        }
        sum
    }

    /// Integrand yᵀ dG x at a node, with G = A + B M C of the linearized equation ẋ = G x.
    fn integrand(&self, tangent: &Tangent, node: &Node) -> Complex64 {
        let (seen, pushed) = self.ends(node);
        let mut sum = Complex64::ZERO;
        if let Some(change) = &tangent.structure {
            let coupling: Matrix3<Complex64> = self.angles(node).map(|angle| self.of_tooth(angle)).sum();
            let own = node.left.transpose() * change.a.map(Complex64::from) * &node.right;
            let pushed_otherwise = change.b.map(Complex64::from).transpose() * &node.left;
            let seen_otherwise = change.c.map(Complex64::from) * &node.right;
            sum += own[(0, 0)]
                + (pushed_otherwise.transpose() * coupling * seen)[(0, 0)]
                + (pushed.transpose() * coupling * seen_otherwise)[(0, 0)];
        }
        if tangent.force.is_some() || tangent.feed_per_tooth_m != 0.0 {
            let change: Matrix3<Complex64> = self
                .angles(node)
                .map(|angle| self.change_of_tooth(tangent, angle))
                .sum();
            sum += (pushed.transpose() * change * seen)[(0, 0)];
        }
        sum
    }

    /// Derivative dM of the force per displacement M of one tooth, N/m per unit of the parameter.
    fn change_of_tooth(&self, tangent: &Tangent, angle: f64) -> Matrix3<Complex64> {
        let process = &self.problem.process;
        let (cutting, normal) = (process.force.cutting.at(angle), process.force.normal.at(angle));
        let none = Vector3::zeros();
        let (cutting_change, normal_change, edge_change) =
            tangent.force.as_ref().map_or((none, none, none), |force| {
                (
                    force.cutting.at(angle),
                    force.normal.at(angle),
                    force.edge.at(angle),
                )
            });
        let directional = cutting_change * normal.transpose() + cutting * normal_change.transpose();
        let mut change = directional.map(|entry| self.kappa * entry);
        if process.axial_depth_modulation {
            let feed = process.feed_per_tooth_m;
            let forced = cutting_change * (normal.x * feed)
                + cutting * (normal_change.x * feed + normal.x * tangent.feed_per_tooth_m)
                + edge_change;
            for i in 0..3 {
                change[(i, 2)] -= forced[i];
            }
        }
        change
    }
}

/// Error for a limit that has no derivative although its Floquet mode is known.
pub(crate) fn no_derivative(rpm: f64, switch: &Switch) -> StabilityError {
    StabilityError::BrokeDown {
        rpm,
        depth_mm: switch.depth_mm,
        what: "the limit lies at the tip of an island and has no derivative",
    }
}

fn bilinear(left: &Vector3<Complex64>, matrix: &Matrix3<f64>, right: &Vector3<Complex64>) -> Complex64 {
    (left.transpose() * matrix.map(Complex64::from) * right)[(0, 0)]
}
