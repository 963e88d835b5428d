//! One tooth period, cut into elements on which collocation is exact to rounding.
//!
//! A chip sees displacement only along its normal: tooth k at immersion φ_k sees the number p_k = n(φ_k)ᵀ u, and the
//! tooth before it saw p_k one period earlier. So the state of the delay equation is x at the start of the period and
//! the numbers p while teeth cut: not the whole history of all displacements.
//!
//! On an element with Gauss nodes t_i, from x(t) = e^{At} x₀ + ∫ e^{A(t−s)} B D(s) f(s) ds with f = w (p − p_τ):
//!
//!   p = E x₀ + Q f,   x₁ = G x₀ + T f,
//!
//! with p and f the values of all cutting teeth at all nodes. The structure's own motion is exact (matrix
//! exponentials), and only the product of motion and turning coefficients is interpolated. Edge and feed terms
//! −β(φ) u are solved for within the element, so that the same four matrices describe it. In free flight G = e^{Ah}.

use nalgebra::DMatrix;

use super::element::Step;
use super::exponential::Exponential;
use super::gauss::Gauss;
use super::linear::Problem;
use crate::error::StabilityError;

pub(crate) use crate::problem::element::{Element, Port};

/// How finely a period is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resolution {
    /// The largest angle, rad, by which the fastest motion turns within an element.
    pub(crate) angle: f64,
    /// Collocation error per element, relative, that is aimed at.
    pub(crate) tolerance: f64,
}

impl Resolution {
    /// For following all multipliers along a line: few nodes, since all eigenvalues of the map are computed.
    pub(crate) const SCAN: Self = Self {
        angle: 20.0,
        tolerance: 1e-8,
    };
    /// For the characteristic matrix, whose polynomials want short elements: limits are computed with this one.
    pub(crate) const WORKING: Self = Self {
        angle: 5.0,
        tolerance: 1e-13,
    };
    /// A second one: what changes from the working one to this is an estimate of the error of the former.
    pub(crate) const FINE: Self = Self {
        angle: 3.0,
        tolerance: 1e-16,
    };
}

/// The most e-folds by which a mode may decay within an element: e^{−A t} appears in it, and its size is lost in digits.
pub(crate) const DECAY_MAX: f64 = 5.0;

/// The most nodes of an element.
const NODES_MAX: u32 = 40;

/// The most elements of the working resolution that a period may have: of five radians each, some thousand vibrations.
const ELEMENTS_MAX: f64 = 4000.0;

/// Refuses a speed and depth, mm, at which the motion turns too often in a tooth period to be followed.
///
/// # Errors
/// [`StabilityError::BrokeDown`] with the reason. Speeds and depths that are none pass: others refuse them.
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

/// One tooth period at one speed.
#[derive(Clone, Debug)]
pub(crate) struct Period {
    /// The elements while teeth cut, in order.
    pub(crate) elements: Vec<Element>,
    /// The flow of free flight after them; the identity where there is none.
    pub(crate) flight: DMatrix<f64>,
}

impl Period {
    /// Cuts the period of a problem at a speed; `depth_m` is the largest |w (1 − 1/μ)| that it will be used for.
    pub(crate) fn new(problem: &Problem, rpm: f64, depth_m: f64, resolution: Resolution) -> Self {
        let structure = &problem.structure;
        let engagement = &problem.process.engagement;
        let seconds_per_radian = problem.tooth_period_s(rpm) / engagement.pitch;
        let rate = Rates::new(problem).at(depth_m);
        let exponential = Exponential::new(&structure.a);
        let mut elements = Vec::new();
        let mut flight = DMatrix::identity(structure.order(), structure.order());
        for interval in engagement.intervals() {
            let length = interval.to - interval.from;
            let duration = length * seconds_per_radian;
            if interval.teeth == 0 {
                flight = exponential.at(duration);
                continue;
            }
            // The coefficients turn as products of two sines: twice the angle of the tool.
            let angle = rate * duration + 2.0 * length;
            let decay = problem.fastest_decay() * duration;
            let count = (angle / resolution.angle).max(decay / DECAY_MAX).ceil().max(1.0);
            let gauss = Gauss::shared(degree(angle / count, resolution.tolerance));
            let step = Step::new(problem, &exponential, gauss, duration / count);
            // The count is small: a few elements for each vibration in the period.
            for index in 0..count as usize {
                let phase = interval.from + length * index as f64 / count;
                elements.push(step.element(problem, interval.teeth, phase, length / count));
            }
        }
        Self { elements, flight }
    }

    /// Number of ports of all elements.
    pub(crate) fn ports(&self) -> usize {
        self.elements.iter().map(|element| element.kernel.nrows()).sum()
    }

    /// Number of states.
    pub(crate) fn order(&self) -> usize {
        self.flight.nrows()
    }
}

/// How fast things move: the structure by itself, and under the stiffness of the cut.
pub(crate) struct Rates {
    /// Fastest pole, rad/s.
    poles: f64,
    /// nᵀ C B D, 1/s per meter of depth: velocity along the chip normal that the chip's own force makes at once.
    direct: f64,
    /// nᵀ C A B D, 1/s² per meter of depth: acceleration along the chip normal that the chip's own force makes at once.
    inertial: f64,
    /// The depth, m, to which edge and feed forces amount.
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
        // All of it varies slowly with the angle; seventeen angles find the largest to a percent or so.
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

    /// An estimate, rad/s, of how fast the solution turns or grows at a depth.
    pub(crate) fn at(&self, depth_m: f64) -> f64 {
        let depth_m = depth_m + self.modulation_m;
        self.poles + (self.inertial * depth_m).sqrt() + self.direct * depth_m
    }
}

/// The fewest nodes, from 4 to 40, with which a step over `angle` has a relative error below `tolerance`:
/// (m!)² z^{2m+1} / ((2m)! (2m+1)!), that of the Padé approximant to e^{iz}.
pub(crate) fn degree(angle: f64, tolerance: f64) -> usize {
    // For m = 0 the expression is z; each further node multiplies it by z² m² / ((2m)² (4m² − 1)).
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
