//! The forced problem: a structure with smooth nonlinear terms under feed and edge forces.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::coefficients::Coefficients;
use crate::criteria::VELOCITY_JUMP;
use crate::error::StabilityError;
use crate::problem::linear::{CubicTerms, Problem};
use crate::problem::pitched::Pitched;
use crate::process::extension::{about_orbit, radial_m};
use crate::process::treatment::is_not_smooth;
use quietcut_model::case::Case;
use quietcut_model::milling::{EdgeAngle, Immersion};
use quietcut_model::structure::{CubicForce, FirstOrder};
use quietcut_model::{ChipLaw, MotionState, ProcessDamping, RestoringForce};

/// Equation of the forced orbit, thesis eqs 6.1 and 3.6 in first-order form:
///
///   ẋ = A x + B F(t, x) − N(x),   u = C x.
///
/// States x as in [`FirstOrder`](quietcut_model::structure::FirstOrder): for matrices x = (q, q̇/s). N contains the
/// cubic terms M⁻¹(C₃ q̇∘³ + K₃ q∘³)/s in the lower half. On an orbit of the tooth period F = (w − z)·Σ_teeth
/// (cutting·n_x f_t + edge), with z the axial displacement under axial-depth modulation, otherwise 0.
///
/// With unequal pitch, or runout on a nonlinear structure, an orbit has the period of the revolution. The chip of tooth
/// j on such an orbit is n_x f_j + n(u − u(t − τ_j)) + (r_j − r_p) sin γ, with the feed f_j during the delay τ_j and
/// the preceding tooth p.
/// The force is linear in the chip thickness through zero: a tooth that would leave the surface pulls, as in the linear
/// problem.
///
/// Extensions of the case add smooth restoring forces −B f_r(u, u̇), a chip law in place of n_x f_t, and process
/// damping −w D(φ) u̇.
#[derive(Clone, Debug)]
pub struct ForcedProblem {
    /// Linear part of the structure and cutting process, with the mean pitch of the teeth.
    pub linear: Problem,
    /// Unequal pitch or runout of the teeth; `None` if all teeth are alike, or if the equation of the orbit is linear.
    pub(super) uneven: Option<Uneven>,
    /// Cubic stiffness and damping terms; `None` for a linear structure.
    pub(super) cubic: Option<CubicForce>,
    /// Smooth restoring forces of the case's extensions, with the structure in the machine's axes; `None` without such
    /// forces.
    pub(super) smooth: Option<Smooth>,
    /// Directional coefficients.
    pub(super) coefficients: Coefficients,
    /// Chip law of the cutting force; `None` if the cutting force is proportional to the chip thickness.
    pub(super) chip: Option<ChipLaw>,
    /// Process damping; `None` if absent.
    flank: Option<Flank>,
    /// Input matrix B times a constant force along the machine's axes; `None` if no such force acts.
    push: Option<DVector<f64>>,
    /// True if the structure has a mass at the tool, so that a force at the tool does not make its velocity jump.
    inertial: bool,
}

/// Teeth with unequal pitch or runout.
#[derive(Clone, Debug)]
pub(super) struct Uneven {
    /// Linear delay problem with the revolution as its period.
    pub(super) pitched: Pitched,
    /// Change of the chip thickness of each tooth by runout, m, by tooth number: its radius minus that of the tooth
    /// that cuts before it, times the sine of the edge angle. That tooth has the next number, after the last one the
    /// first.
    pub(super) runout_m: Vec<f64>,
}

impl Uneven {
    /// Unequal pitch or runout of a case; `None` if all teeth are alike.
    fn of(case: &Case, pitched: &Pitched) -> Result<Option<Self>, StabilityError> {
        let sin_edge = EdgeAngle::new(case.tool()?.edge_angle_deg).sin();
        let radial_m = radial_m(case)?;
        let before = radial_m.iter().cycle().skip(1);
        let runout_m: Vec<f64> = radial_m
            .iter()
            .zip(before)
            .map(|(own, before)| (own - before) * sin_edge)
            .collect();
        let runs_out = runout_m.iter().any(|chip_m| *chip_m != 0.0);
        Ok((runs_out || pitched.has_variable_pitch()).then(|| Self {
            pitched: pitched.clone().over_revolution(),
            runout_m,
        }))
    }
}

/// True if the teeth of the case have unequal pitch, or runout that changes their chip thickness.
pub(super) fn has_unequal_teeth(case: &Case) -> Result<bool, StabilityError> {
    let pitched = Pitched::new(case, CubicTerms::Kept)?;
    Ok(Uneven::of(case, &pitched)?.is_some())
}

/// Smooth restoring forces f_r of the case's extensions, along the machine's axes.
#[derive(Clone, Debug)]
pub(super) struct Smooth {
    terms: Vec<Arc<dyn RestoringForce>>,
    /// Input matrix B of the structure for forces along the machine's axes.
    b: DMatrix<f64>,
    /// Output matrix C that gives the displacement along the machine's axes from the states.
    displacement: DMatrix<f64>,
    /// Output matrix C A that gives the velocity along the machine's axes from the states.
    velocity: DMatrix<f64>,
}

/// Process damping by contact of the tooth's flank with the wavy surface.
#[derive(Clone, Debug)]
struct Flank {
    law: ProcessDamping,
    edge: EdgeAngle,
    radius_m: f64,
    /// Output matrix C A of the structure for the velocity in feed, normal and axial direction.
    velocity: DMatrix<f64>,
}

impl Smooth {
    fn new(terms: Vec<Arc<dyn RestoringForce>>, machine: &FirstOrder) -> Self {
        let part = |rows: usize, columns: usize, of: &dyn Fn(usize, usize) -> f64| {
            DMatrix::from_fn(rows, columns, of)
        };
        let order = machine.order();
        Self {
            terms,
            b: part(order, 3, &|i, j| machine.b[(i, j)]),
            displacement: part(3, order, &|i, j| machine.c[(i, j)]),
            velocity: part(3, order, &|i, j| {
                machine.c.row(i).dot(&machine.a.column(j).transpose())
            }),
        }
    }

    fn at(&self, state: &[f64]) -> MotionState {
        let row =
            |matrix: &DMatrix<f64>, axis: usize| matrix.row(axis).iter().zip(state).map(|(a, b)| a * b).sum();
        MotionState {
            t: 0.0,
            x: std::array::from_fn(|axis| row(&self.displacement, axis)),
            v: std::array::from_fn(|axis| row(&self.velocity, axis)),
        }
    }
}

/// Cubic terms N(x) of a case, which act on the lower half of the states of its linear problem; `None` for a linear
/// structure.
fn cubic_force(case: &Case, linear: &Problem) -> Result<Option<CubicForce>, StabilityError> {
    let structure = case.structure()?;
    let Some(matrices) = structure.equation().filter(|_| structure.is_nonlinear()) else {
        return Ok(None);
    };
    // The lower half of the states is q̇/s. The scale s stands in the upper right corner of A, so that q̇ = s·(lower
    // half).
    let scale = linear.structure.a[(0, matrices.mass.nrows())];
    CubicForce::in_first_order(&matrices, scale)
        .map(Some)
        .map_err(|cause| StabilityError::Structure {
            path: case.path.clone(),
            cause,
        })
}

impl ForcedProblem {
    /// Builds the forced problem of a case, whose solutions are forced periodic orbits.
    ///
    /// # Errors
    /// As [`Pitched::new`]; cubic terms are accepted. Process damping and smooth restoring forces are refused without a
    /// mass at the tool, a chip law for teeth with unequal pitch or runout, and unequal pitch without cubic terms and
    /// smooth restoring forces. Friction, backlash and hysteresis are refused too;
    /// [`EquivalentProblem`](super::EquivalentProblem) treats them.
    pub fn new(case: &Case) -> Result<Self, StabilityError> {
        if is_not_smooth(case) {
            return Err(StabilityError::NotCovered {
                path: case.path.clone(),
                what: "friction, backlash and hysteresis have no slopes about a forced orbit; their equivalent stiffness and \
                       damping are needed",
            });
        }
        let pitched = Pitched::new(case, CubicTerms::Kept)?;
        let linear = pitched.with_mean_pitch().clone();
        let uneven = Uneven::of(case, &pitched)?;
        let cubic = cubic_force(case, &linear)?;
        let about = about_orbit(case)?;
        let machine = linear.structure.rotated(-case.cut()?.feed_direction_deg);
        let jump = (&machine.c * &machine.b).amax();
        let inertial = jump <= VELOCITY_JUMP * machine.c.amax() * machine.b.amax() * machine.order() as f64;
        if !inertial && (about.law.process_damping.is_some() || !about.terms.is_empty()) {
            return Err(StabilityError::NotCovered {
                path: case.path.clone(),
                what: "its modes add up to no mass (their residues do not sum to zero), so that a force on the velocity or \
                       on a nonlinear spring has no motion of its own; use mass, damping and stiffness matrices for \
                       process-damping and smooth terms",
            });
        }
        let flank = match (about.law.process_damping, case.tool()?.diameter_mm) {
            (Some(law), Some(diameter_mm)) => Some(Flank {
                law,
                edge: EdgeAngle::new(case.tool()?.edge_angle_deg),
                radius_m: 0.5e-3 * diameter_mm,
                velocity: Smooth::new(Vec::new(), &linear.structure).velocity,
            }),
            _ => None,
        };
        let is_linear = cubic.is_none() && about.terms.is_empty();
        let refuse = |what| {
            Err(StabilityError::NotCovered {
                path: case.path.clone(),
                what,
            })
        };
        if uneven.is_some() && about.law.chip.is_some() {
            return refuse(
                "tool.pitch_deg or runout beside extension.force-exponent: chips of unequal teeth vanish and turn round within the \
                 forced orbit, and there a power of the chip has no slope; equal pitch without runout is needed",
            );
        }
        if is_linear && pitched.has_variable_pitch() {
            return refuse(
                "tool.pitch_deg: on a linear structure the forced orbit of teeth at unequal pitch is not followed, it grows beyond \
                 all bounds where a Floquet multiplier over the revolution reaches 1; equal pitch is needed beside process-damping",
            );
        }
        Ok(Self {
            // Runout on a linear structure moves the orbit, but does not change the equation linearized about it.
            uneven: uneven.filter(|_| !is_linear),
            smooth: (!about.terms.is_empty()).then(|| Smooth::new(about.terms, &machine)),
            chip: about.law.chip,
            flank,
            push: None,
            coefficients: Coefficients::Exact,
            inertial,
            linear,
            cubic,
        })
    }

    /// The same problem with springs and dampers between tool and ground and a constant force, along the machine's
    /// axes: f_r = `stiffness` x + `damping` ẋ (N/m, N s/m), under `force_n`. `feed_direction_deg` is the feed
    /// direction in these axes.
    pub(super) fn with_springs(
        &self,
        feed_direction_deg: f64,
        stiffness: [f64; 3],
        damping: [f64; 3],
        force_n: [f64; 3],
    ) -> Self {
        let machine = self.linear.structure.rotated(-feed_direction_deg);
        let mut changed = self.clone();
        for axis in 0..3 {
            let displacement = machine.c.row(axis);
            let force = displacement * stiffness[axis] + displacement * &machine.a * damping[axis];
            changed.linear.structure.a -= machine.b.column(axis) * force;
        }
        changed.push = Some(&machine.b * Vector3::from(force_n));
        changed
    }

    /// True if the structure has a mass at the tool, so that a force at the tool does not make its velocity jump.
    pub(super) fn is_inertial(&self) -> bool {
        self.inertial
    }

    /// True if forced orbits have the period of the revolution, not the tooth period. One spindle speed then takes
    /// about a hundred times the computing time.
    pub fn is_over_revolution(&self) -> bool {
        self.uneven.is_some()
    }

    /// True if the equation of the orbit is linear: without cubic terms and smooth restoring forces.
    pub(super) fn is_linear(&self) -> bool {
        self.cubic.is_none() && self.smooth.is_none()
    }

    /// Process damping per axial depth, N s/m², in feed, normal and axial direction, for teeth at given immersion
    /// angles (rad) and a spindle speed (rad/s); `None` if absent.
    pub(super) fn damping_per_depth(
        &self,
        angles: impl Iterator<Item = f64>,
        speed_rad_per_s: f64,
    ) -> Option<Matrix3<f64>> {
        let flank = self.flank.as_ref()?;
        let size = flank.law.n_per_m / (flank.radius_m * speed_rad_per_s);
        let sum: Matrix3<f64> = angles
            .map(|angle| {
                let rows = flank.edge.flank(flank.law.friction, Immersion::new(angle));
                Matrix3::from_fn(|i, j| rows[i][j])
            })
            .sum();
        Some(sum * size)
    }

    /// Matrix B D C A by which process damping enters the equation of motion, per axial depth; zero without process
    /// damping.
    pub(super) fn damped(&self, damping: &Matrix3<f64>) -> DMatrix<f64> {
        let Some(flank) = &self.flank else {
            return DMatrix::zeros(self.order(), self.order());
        };
        &self.linear.structure.b * damping * &flank.velocity
    }

    /// Slope of the chip law, the derivative of effective over geometric chip thickness, at the chip thickness of the
    /// feed at an immersion angle (rad); 1 without a chip law.
    pub(super) fn chip_slope(&self, angle: f64) -> f64 {
        let process = &self.linear.process;
        self.chip.map_or(1.0, |chip| {
            chip.slope(process.force.normal.at(angle).x * process.feed_per_tooth_m)
        })
    }

    /// Spindle speed, rad/s, at which the tooth period is `period_s`.
    pub(super) fn speed_rad_per_s(&self, period_s: f64) -> f64 {
        TAU / (period_s * self.linear.teeth as f64)
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.linear.structure.order()
    }

    /// Force per axial depth, N/m, due to feed and edges, of all ports of the cut at a phase of the tooth period (rad).
    /// The vibration does not enter.
    pub(super) fn force_per_depth(&self, teeth: usize, phase: f64) -> Vector3<f64> {
        let process = &self.linear.process;
        if let Some(averaged) = self.averaged_force() {
            return averaged;
        }
        (0..teeth)
            .map(|tooth| {
                let angle = process.engagement.angle(tooth, phase);
                match self.chip {
                    None => process.force.forced(angle, process.feed_per_tooth_m) * self.share(angle),
                    Some(chip) => {
                        let thickness_m = process.force.normal.at(angle).x * process.feed_per_tooth_m;
                        process.force.cutting.at(angle) * chip.effective_m(thickness_m)
                            + process.force.edge.at(angle)
                    }
                }
            })
            .sum()
    }

    /// Subtracts the cubic terms N(x) and the smooth restoring forces B f_r from the time derivative `rate` of the
    /// state, and adds the constant force.
    pub(super) fn subtract_smooth(&self, state: &[f64], rate: &mut DVector<f64>) {
        if let Some(push) = &self.push {
            *rate += push;
        }
        if let Some(smooth) = &self.smooth {
            let at = smooth.at(state);
            for term in &smooth.terms {
                *rate -= &smooth.b * Vector3::from(term.restoring_n(0, &at, &[]));
            }
        }
        let Some(cubic) = &self.cubic else { return };
        let size = cubic.size();
        let (q, v) = (&state[..size], &state[size..2 * size]);
        for (rate, force) in rate.as_mut_slice()[size..].iter_mut().zip(cubic.at(q, v)) {
            *rate -= force;
        }
    }

    /// Axial depth of cut when the structure is in a state, m: reduced by the axial displacement of the tool under
    /// axial-depth modulation.
    pub(super) fn depth_at(&self, state: &DVector<f64>, depth_m: f64) -> f64 {
        if self.linear.process.axial_depth_modulation {
            depth_m - (self.linear.structure.c.row(2) * state)[0]
        } else {
            depth_m
        }
    }

    /// Jacobian of the equation of a forced orbit at a state, A − ∂N/∂x − B ∂f_r/∂x − B·(force per depth)·∂z/∂x,
    /// without process damping and without the influence of the vibration on the chip thickness.
    pub(super) fn jacobian(&self, state: &[f64], force_per_depth: &Vector3<f64>) -> DMatrix<f64> {
        let structure = &self.linear.structure;
        let mut jacobian = structure.a.clone();
        if let Some(cubic) = &self.cubic {
            let size = cubic.size();
            let (q, v) = (&state[..size], &state[size..2 * size]);
            for i in 0..size {
                for j in 0..size {
                    let [by_q, by_v] = cubic.slopes((i, j), q, v);
                    jacobian[(size + i, j)] -= by_q;
                    jacobian[(size + i, size + j)] -= by_v;
                }
            }
        }
        if let Some(smooth) = &self.smooth {
            let at = smooth.at(state);
            for slopes in smooth.terms.iter().filter_map(|term| term.slopes(&at)) {
                let part = |rows: [[f64; 3]; 3]| Matrix3::from_fn(|i, j| rows[i][j]);
                jacobian -= &smooth.b
                    * (part(slopes.stiffness) * &smooth.displacement
                        + part(slopes.damping) * &smooth.velocity);
            }
        }
        if self.linear.process.axial_depth_modulation {
            jacobian -= (&structure.b * force_per_depth) * structure.c.row(2);
        }
        jacobian
    }
}
