//! One tooth period, divided into elements on which collocation has a chosen accuracy.
//!
//! The dynamic chip thickness depends only on the displacement along the chip normal: tooth k at immersion φ_k observes
//! p_k = n(φ_k)ᵀ u, and the preceding tooth observed p_k one period earlier. The state of the delay equation is
//! therefore x at the start of the period and the values p of the preceding period while teeth cut. The history of all
//! displacements is not needed.
//!
//! On an element with Gauss nodes t_i, x(t) = e^{At} x₀ + ∫ e^{A(t−s)} B D(s) f(s) ds with f = w (p − p_τ) gives
//!
//!   p = E x₀ + Q f,   x₁ = G x₀ + T f,
//!
//! with p and f the values of all cutting teeth at all nodes, and D the force directions of these teeth. The free
//! motion of the structure is exact (matrix exponentials); only the product of motion and rotating directional
//! coefficients is interpolated. The forces −β(φ) u of edge and feed are eliminated within the element, so that the
//! same four matrices E, Q, G and T describe it. In free flight (no tooth cuts) G = e^{Ah}.

use nalgebra::DMatrix;

use super::element::Step;
use super::exponential::Exponential;
use super::linear::Problem;
use crate::criteria::ELEMENTS_MAX;
use crate::error::StabilityError;
use quietcut_numerics::quadrature::Gauss;

pub(crate) use crate::problem::element::{Element, Port};

/// Required resolution of the mesh over a tooth period: bounds of the length of its elements, as a phase angle, and of the
/// error of collocation in each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resolution {
    /// Largest phase angle, rad, by which the fastest motion may rotate over one element.
    pub(crate) angle: f64,
    /// Target for the relative error of collocation in one element.
    pub(crate) tolerance: f64,
}

impl Resolution {
    /// Coarse mesh, on which many Floquet multipliers are computed together at many depths. Its elements are long and
    /// have few nodes in all, since the eigenvalues of the whole map are computed.
    pub(crate) const SCAN: Self = Self {
        angle: 20.0,
        tolerance: 1e-8,
    };
    /// Working mesh, on which single multipliers and limits are computed from the characteristic matrix. Its elements
    /// are short, so that the polynomials in the complex depth κ converge.
    pub(crate) const WORKING: Self = Self {
        angle: 5.0,
        tolerance: 1e-13,
    };
    /// Finer mesh of the tooth period: the change of a result from the working mesh to this one estimates the error of
    /// the working mesh.
    pub(crate) const FINE: Self = Self {
        angle: 3.0,
        tolerance: 1e-16,
    };
}

/// Largest product of decay rate and duration of an element. Collocation uses e^{−A t}, which grows where the structure
/// decays; the factor e⁵ = 148 between start and end of an element costs two digits.
pub(crate) const DECAY_MAX: f64 = 5.0;

/// Largest number of Gauss nodes in an element: the largest rule that [`Gauss::shared`] keeps.
const NODES_MAX: u32 = 40;

/// Refuses speeds and depths (mm) at which the motion oscillates or decays too fast to be followed over a tooth period.
///
/// # Errors
/// [`StabilityError::BrokeDown`] with the reason. The signs of speed and depth are not checked here, but by the
/// methods.
pub(crate) fn check_length(problem: &Problem, rpm: f64, depth_mm: f64) -> Result<(), StabilityError> {
    let rate = Rates::new(problem).at(2e-3 * depth_mm) + problem.fastest_decay();
    if rate * problem.tooth_period_s(rpm) > ELEMENTS_MAX * Resolution::WORKING.angle {
        return Err(StabilityError::BrokeDown {
            rpm,
            depth_mm,
            what: "the structure vibrates more often in a tooth period than can be followed; \
                   a higher speed or a smaller depth is needed",
        });
    }
    Ok(())
}

/// Mesh of one tooth period at one spindle speed.
#[derive(Clone, Debug)]
pub(crate) struct Period {
    /// Elements of the period during which teeth cut, in order of time.
    pub(crate) elements: Vec<Element>,
    /// State transition of the free flight after the elements, n × n: e^{Ah} for a linear structure; the identity if
    /// teeth cut until the end of the period.
    pub(crate) flight: DMatrix<f64>,
}

impl Period {
    /// Divides the tooth period at a spindle speed into elements; `depth_m` is the largest complex depth |w (1 − 1/μ)|
    /// to resolve.
    pub(crate) fn new(problem: &Problem, rpm: f64, depth_m: f64, resolution: Resolution) -> Self {
        let structure = &problem.structure;
        let engagement = &problem.process.engagement;
        let seconds_per_radian = problem.tooth_period_s(rpm) / engagement.pitch;
        let rate = Rates::new(problem).at(depth_m);
        let exponential = Exponential::new(&structure.a);
        let mut elements = Vec::new();
        let mut flight = DMatrix::identity(structure.order(), structure.order());
        for interval in engagement.subintervals() {
            let length = interval.to - interval.from;
            let duration = length * seconds_per_radian;
            if interval.teeth == 0 {
                flight = exponential.at(duration);
                continue;
            }
            // The directional coefficients of the cut contain products of two sines of the immersion angle, which
            // oscillate at twice the rotation of the tool.
            let angle = rate * duration + 2.0 * length;
            let decay = problem.fastest_decay() * duration;
            let count = (angle / resolution.angle).max(decay / DECAY_MAX).ceil().max(1.0);
            let gauss = Gauss::shared(degree(angle / count, resolution.tolerance));
            let step = Step::new(problem, &exponential, gauss, duration / count);
            // The conversion to an integer is exact: the count is a few elements for each vibration in the period.
            for index in 0..count as usize {
                let phase = interval.from + length * index as f64 / count;
                elements.push(step.element(problem, interval.teeth, phase, length / count));
            }
        }
        Self { elements, flight }
    }

    /// Number of ports (a port is a cutting tooth at a node) of all elements.
    pub(crate) fn ports(&self) -> usize {
        self.elements.iter().map(|element| element.kernel.nrows()).sum()
    }

    /// Number n of states of the structure.
    pub(crate) fn order(&self) -> usize {
        self.flight.nrows()
    }
}

/// Rates of the fastest motion of a cut: poles of the free structure, and stiffening by the cutting force.
pub(crate) struct Rates {
    /// Largest magnitude of a pole of the free structure, rad/s.
    poles: f64,
    /// Velocity along the chip normal that the cutting force causes immediately, per displacement along the chip
    /// normal: nᵀ C B D, 1/s per meter of axial depth. The largest magnitude over the immersion, times the largest
    /// number of cutting teeth.
    direct: f64,
    /// Acceleration along the chip normal that the cutting force causes immediately, per displacement along the chip
    /// normal: nᵀ C A B D, 1/s² per meter of axial depth. The largest magnitude over the immersion, times the largest
    /// number of cutting teeth.
    inertial: f64,
    /// Axial depth, m, at which the cutting force per displacement is as large as the edge and feed force per axial
    /// displacement; 0 without axial-depth modulation.
    modulation_m: f64,
}

impl Rates {
    pub(crate) fn new(problem: &Problem) -> Self {
        let structure = &problem.structure;
        let process = &problem.process;
        let engagement = &process.engagement;
        let response = &structure.c * &structure.b;
        let response_rate = &structure.c * &structure.a * &structure.b;
        let (mut direct, mut inertial, mut force, mut forced) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        // The cutting force varies slowly with the immersion angle: seventeen angles find its maximum to about one
        // percent.
        for i in 0..=16 {
            let share = f64::from(i) / 16.0;
            let angle = engagement.start + (engagement.exit - engagement.start) * share;
            let (normal, cutting) = (process.force.normal.at(angle), process.force.cutting.at(angle));
            direct = direct.max(normal.dot(&(response * cutting)).abs());
            inertial = inertial.max(normal.dot(&(response_rate * cutting)).abs());
            force = force.max(process.force.directional(angle).norm());
            forced = forced.max(process.force.forced(angle, process.feed_per_tooth_m).norm());
        }
        let teeth = engagement.mean_teeth().ceil();
        Self {
            poles: structure
                .poles()
                .iter()
                .map(|pole| pole.norm())
                .fold(0.0, f64::max),
            direct: direct * teeth,
            inertial: inertial * teeth,
            modulation_m: if process.axial_depth_modulation && force > 0.0 {
                forced / force
            } else {
                0.0
            },
        }
    }

    /// Estimate of the rate at which the solution oscillates or grows at an axial depth, rad/s.
    pub(crate) fn at(&self, depth_m: f64) -> f64 {
        let depth_m = depth_m + self.modulation_m;
        self.poles + (self.inertial * depth_m).sqrt() + self.direct * depth_m
    }
}

/// Fewest Gauss nodes, from 4 to 40, for which a step over the phase angle `angle` has a relative error below
/// `tolerance`; 40 if none suffices. The error is that of the Padé approximant to e^{iz}: (m!)² z^{2m+1} / ((2m)!
/// (2m+1)!).
pub(crate) fn degree(angle: f64, tolerance: f64) -> usize {
    // For m = 0 Gauss nodes the error expression is z; each further node multiplies it by z² m² / ((2m)² (4m² − 1)).
    let mut error = angle;
    for m in 1..=NODES_MAX {
        let m_f = f64::from(m);
        error *= angle * angle / (4.0 * (2.0 * m_f - 1.0) * (2.0 * m_f + 1.0));
        if error < tolerance && m >= 4 {
            return m as usize;
        }
    }
    NODES_MAX as usize
}
