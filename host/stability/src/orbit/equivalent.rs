//! Friction, backlash and hysteresis in stability: their equivalent stiffness and damping on the forced orbit.
//!
//! Along the forced orbit x = x̄ + x̃ of period T a term that is not smooth has the force f(t). It is replaced by the
//! linear force f̄ + k x̃ + c ẋ that is nearest to f in the mean square over the period,
//!
//!   k = ⟨f x̃⟩/⟨x̃²⟩,   c = ⟨f ẋ⟩/⟨ẋ²⟩   (⟨x̃ ẋ⟩ = 0 on a periodic orbit).
//!
//! This is the describing function for a harmonic orbit, and its generalization to all harmonics otherwise. The orbit
//! depends on k, c and f̄ and determines them, so that all are solved for together. Floquet multipliers (characteristic
//! multipliers) are those of the delay equation with this spring and damper.
//!
//! A small disturbance of a large orbit sees another stiffness: the change of the force per disturbance (the
//! incremental describing function; for dry friction on a harmonic orbit half of c). The distance to the multiplier
//! with these values is the stated error.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::anderson::Anderson;
use super::follower::size_at;
use super::forced::{ForcedProblem, has_unequal_teeth};
use super::periodic_orbit::{Orbit, PeriodMap, Scale};
use super::restoring::{Samples, Spring, equivalent, incremental};
use super::tooth_period::ToothPeriod;
use crate::criteria::{EQUIVALENT_FOLLOWED, EQUIVALENT_SAMPLES_MIN, LEAST_ERROR, STICKING_DAMPER};
use crate::error::StabilityError;
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::{SpeedLine, Switch};
use crate::process::extension::not_smooth;
use crate::spectrum::stability_loss::StabilityLoss;
use quietcut_model::RestoringForce;
use quietcut_model::case::Case;
use quietcut_model::effects::{ALL, Treatment};

/// Largest change of the equivalent springs in an iteration, in their [`Units`] or relative to the largest spring if
/// that is above 1, at which springs and orbit count as agreeing.
const SETTLED: f64 = 1e-7;

/// Largest number of iterations in which equivalent springs and orbit are computed from each other. A choice.
const ROUNDS: usize = 200;

/// Number of earlier iterations of springs and orbit that Anderson acceleration stores. A choice.
const REMEMBERED: usize = 5;

/// Width to which the depth interval around a crossing of the unit circle by a multiplier is narrowed, relative to the
/// last depth.
const CROSSING: f64 = 1e-6;

/// Axial depth, mm, that replaces depth 0, and smaller depths of a single cut: at depth 0 the tool is at rest, and
/// equivalent stiffness and damping are not defined.
const NONE_MM: f64 = 1e-4;

/// Stability problem of a case with friction, backlash or hysteresis, which act through equivalent springs and dampers.
#[derive(Debug)]
pub struct EquivalentProblem {
    /// Forced problem of the case without its friction, backlash and hysteresis.
    smooth: ForcedProblem,
    terms: Vec<Box<dyn RestoringForce>>,
    feed_direction_deg: f64,
    /// Matrix from the states of the structure to the displacement of the tool along the machine's axes, 3 × n.
    displacement: DMatrix<f64>,
    /// Matrix from the states of the structure to the velocity of the tool along the machine's axes, 3 × n.
    velocity: DMatrix<f64>,
    /// Static stiffness of the structure along each axis, N/m; 0 for an axis without positive static flexibility.
    stiffness: [f64; 3],
    /// Damping constant along each axis that stands for sticking friction, N s/m: see [`STICKING_DAMPER`].
    most_damping: [f64; 3],
}

/// Forced orbit and its equivalent springs, which agree with each other.
#[derive(Clone)]
struct Settled {
    springs: [Spring; 3],
    orbit: Orbit,
}

/// Forced orbit at one axial depth, with its Floquet multipliers.
#[derive(Clone)]
struct Sample {
    settled: Settled,
    /// Floquet multipliers of the orbit above [`EQUIVALENT_FOLLOWED`], in the upper half plane or on the real axis,
    /// largest first.
    roots: Vec<Complex64>,
}

impl Sample {
    fn depth_m(&self) -> f64 {
        self.settled.orbit.value
    }

    fn outside(&self) -> i32 {
        let outside = self.roots.iter().filter(|root| root.norm() > 1.0);
        outside.map(|root| StabilityLoss::of(*root).count()).sum()
    }

    /// Distance |μ| − 1 of the orbit's largest multiplier from the unit circle; −1 if none is followed.
    fn excess(&self) -> f64 {
        self.roots.first().map_or(-1.0, |root| root.norm() - 1.0)
    }
}

impl EquivalentProblem {
    /// Builds the stability problem of a case with friction, backlash or hysteresis.
    ///
    /// # Errors
    /// As [`ForcedProblem::new`] for the case without friction, backlash and hysteresis, or one of these cannot be
    /// applied to the case, or the structure has no mass at the tool, or the teeth have unequal pitch or runout: the
    /// orbit, and with it the equivalent springs, would repeat once a revolution.
    pub fn new(case: &Case) -> Result<Self, StabilityError> {
        let mut rest = case.clone();
        for spec in ALL
            .into_iter()
            .filter(|spec| spec.treatment == Treatment::Equivalent)
        {
            rest.extensions.remove(spec.name);
        }
        let smooth = ForcedProblem::new(&rest)?;
        if !smooth.is_inertial() {
            return Err(StabilityError::NotCovered {
                path: case.path.clone(),
                what: "its modes add up to no mass (their residues do not sum to zero), so that friction, backlash and \
                       hysteresis have no motion of their own; use mass, damping and stiffness matrices",
            });
        }
        if has_unequal_teeth(&rest)? {
            return Err(StabilityError::NotCovered {
                path: case.path.clone(),
                what: "friction, backlash and hysteresis go with teeth that are all alike only: leave out runout, and unequal pitch",
            });
        }
        let feed_direction_deg = case.cut()?.feed_direction_deg;
        let machine = smooth.linear.structure.rotated(-feed_direction_deg);
        let order = machine.order();
        let at_rest = machine.receptance(0.0);
        let stiffness = std::array::from_fn(|axis| {
            let flexibility = at_rest.map_or(0.0, |receptance| receptance[(axis, axis)].re);
            if flexibility > 0.0 {
                flexibility.recip()
            } else {
                0.0
            }
        });
        let slowest = machine
            .poles()
            .iter()
            .map(|pole| pole.norm())
            .fold(f64::INFINITY, f64::min);
        Ok(Self {
            terms: not_smooth(case)?,
            feed_direction_deg,
            displacement: DMatrix::from_fn(3, order, |i, j| machine.c[(i, j)]),
            velocity: DMatrix::from_fn(3, order, |i, j| {
                machine.c.row(i).dot(&machine.a.column(j).transpose())
            }),
            most_damping: stiffness.map(|stiffness: f64| STICKING_DAMPER * stiffness / slowest),
            stiffness,
            smooth,
        })
    }

    fn with(&self, springs: &[Spring; 3]) -> ForcedProblem {
        self.smooth.with_springs(
            self.feed_direction_deg,
            springs.map(|spring| spring.stiffness),
            springs.map(|spring| spring.damping),
            springs.map(|spring| -spring.force_n),
        )
    }
}

/// Follows the branch of forced orbits and their equivalent springs at one spindle speed.
struct Follower<'a> {
    problem: &'a EquivalentProblem,
    rpm: f64,
    period_s: f64,
    map: ToothPeriod<'a>,
}

impl<'a> Follower<'a> {
    fn new(problem: &'a EquivalentProblem, rpm: f64) -> Self {
        Self {
            problem,
            rpm,
            period_s: problem.smooth.linear.tooth_period_s(rpm),
            map: ToothPeriod::new(&problem.smooth, rpm),
        }
    }

    fn broke_down(&self, depth_m: f64, what: &'static str) -> StabilityError {
        StabilityError::BrokeDown {
            rpm: self.rpm,
            depth_mm: 1e3 * depth_m,
            what,
        }
    }

    fn samples(&self, orbit: &Orbit) -> Samples {
        let seen = [&self.problem.displacement, &self.problem.velocity];
        Samples::new(&self.map.subinterval_nodes(), orbit, self.period_s, seen)
    }

    /// Rest of the tool, with zero equivalent springs.
    fn rest(&self) -> Settled {
        Settled {
            springs: [Spring::default(); 3],
            orbit: Orbit::rest(&self.map),
        }
    }

    /// Forced orbit and equivalent springs that agree with each other at a depth, from a guess.
    fn settle(&self, depth_m: f64, guess: &Settled) -> Result<Settled, StabilityError> {
        let all = self.problem;
        let mut now = guess.clone();
        now.orbit.value = depth_m;
        let mut mixing = Anderson::new(REMEMBERED);
        let mut units = None;
        for _ in 0..ROUNDS {
            now.orbit = self.orbit(&now.springs, &now.orbit)?;
            let samples = self.samples(&now.orbit);
            let found = equivalent(&all.terms, &samples, all.most_damping);
            let units = units.get_or_insert_with(|| Units::new(all, &samples, self.period_s));
            let (at, to) = (units.vector(&now.springs), units.vector(&found));
            if (&to - &at).amax() <= SETTLED * at.amax().max(1.0) {
                return Ok(now);
            }
            now.springs = units.springs(&mixing.next(&at, &to), all.most_damping);
        }
        Err(self.broke_down(
            depth_m,
            "the forced orbit and the equivalent stiffness and damping at its amplitude do not come to agree",
        ))
    }

    /// Forced orbit with given equivalent springs, at the depth of a guess.
    fn orbit(&self, springs: &[Spring; 3], guess: &Orbit) -> Result<Orbit, StabilityError> {
        let problem = self.problem.with(springs);
        let map = self.map.of(&problem);
        let none = |_| {
            self.broke_down(
                guess.value,
                "no forced orbit is found with the equivalent springs",
            )
        };
        if problem.is_linear() {
            return Orbit::of_linear(&map, guess.value).map_err(none);
        }
        let scale = Scale {
            state: size_at(&map, guess.value),
            value: guess.value,
        };
        let mut along_depth = DVector::zeros(map.size() + 1);
        along_depth[map.size()] = 1.0;
        Orbit::correct(&map, guess, scale, &along_depth)
            .map(|(orbit, _)| orbit)
            .map_err(none)
    }

    fn sample(&self, depth_m: f64, guess: &Settled) -> Result<Sample, StabilityError> {
        let settled = self.settle(depth_m, guess)?;
        let roots = self.roots(&settled.springs, &settled.orbit)?;
        Ok(Sample { settled, roots })
    }

    /// Floquet multipliers with |μ| above [`EQUIVALENT_FOLLOWED`] about an orbit with given equivalent springs, in the
    /// upper half plane or on the real axis, largest first.
    fn roots(&self, springs: &[Spring; 3], orbit: &Orbit) -> Result<Vec<Complex64>, StabilityError> {
        let problem = self.problem.with(springs);
        let singular = "the equations of the forced orbit are singular";
        let all = self.map.of(&problem).multipliers(orbit);
        let all = all.map_err(|cause| cause.at(self.rpm, 1e3 * orbit.value, singular))?;
        Ok(all
            .into_iter()
            .take_while(|multiplier| multiplier.norm() > EQUIVALENT_FOLLOWED)
            .filter(|multiplier| multiplier.im >= 0.0)
            .collect())
    }

    fn chatter_hz(&self, sample: &Sample, root: Complex64) -> Option<f64> {
        let problem = self.problem.with(&sample.settled.springs);
        self.map.of(&problem).chatter_hz(&sample.settled.orbit, root)
    }

    /// Error of |μ|: the distance of the multiplier `root` from the nearest one with the incremental stiffness and
    /// damping that a small disturbance of the orbit sees.
    fn error(
        &self,
        sample: &Sample,
        root: Complex64,
        chatter_hz: Option<f64>,
    ) -> Result<f64, StabilityError> {
        let samples = self.samples(&sample.settled.orbit);
        let frequency_hz = chatter_hz.unwrap_or_else(|| self.period_s.recip());
        let slopes = incremental(
            &self.problem.terms,
            &samples,
            frequency_hz,
            &sample.settled.springs,
            self.problem.most_damping,
        );
        let small = self.roots(&slopes, &sample.settled.orbit)?;
        let nearest = small
            .iter()
            .map(|other| (other - root).norm())
            .fold(f64::INFINITY, f64::min);
        // The error is at most |μ|, also if no multiplier of the small disturbance exceeds [`EQUIVALENT_FOLLOWED`].
        Ok(nearest.min(root.norm()).max(LEAST_ERROR * root.norm().max(1.0)))
    }

    /// Stability switches between two sampled depths at which the number of multipliers outside the unit circle
    /// changes, by depth.
    fn between(&self, low: &Sample, high: &Sample, last_m: f64) -> Result<Vec<Switch>, StabilityError> {
        let (mut low, mut high) = (low.clone(), high.clone());
        let mut switches = Vec::new();
        let top = high.clone();
        while low.outside() != top.outside() {
            high.clone_from(&top);
            // If no multiplier is outside the unit circle at one end of the depth interval, the largest one crosses and
            // |μ| − 1 is interpolated, with a bisection after every three steps. Otherwise one of several crosses, and
            // the interval is bisected.
            let is_largest = |low: &Sample, high: &Sample| (low.outside() == 0) != (high.outside() == 0);
            let mut halves = 0;
            while high.depth_m() - low.depth_m() > CROSSING * last_m {
                let share = if is_largest(&low, &high) && halves < 3 {
                    (low.excess() / (low.excess() - high.excess())).clamp(0.05, 0.95)
                } else {
                    0.5
                };
                let depth_m = low.depth_m() + share * (high.depth_m() - low.depth_m());
                let middle = self.sample(depth_m, &low.settled)?;
                halves = if share == 0.5 { 0 } else { halves + 1 };
                if middle.outside() == low.outside() {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            switches.push(self.switch(&low, &high, last_m)?);
            low = high.clone();
        }
        Ok(switches)
    }

    /// Stability switch between two depths that differ by no more than [`CROSSING`] of the last depth.
    fn switch(&self, low: &Sample, high: &Sample, last_m: f64) -> Result<Switch, StabilityError> {
        let gain = high.outside() < low.outside();
        let outer = if gain { low } else { high };
        let crossed = outer
            .roots
            .iter()
            .filter(|root| root.norm() > 1.0)
            .min_by(|a, b| a.norm().total_cmp(&b.norm()))
            .copied()
            .ok_or_else(|| {
                self.broke_down(
                    high.depth_m(),
                    "a Floquet multiplier was lost while the interval of depth was halved",
                )
            })?;
        let chatter_hz = match StabilityLoss::of(crossed) {
            StabilityLoss::Fold => None,
            _ => self.chatter_hz(outer, crossed),
        };
        let error = self.error(outer, crossed, chatter_hz)?;
        // Slope d|μ|/dw over the axial depth w, from a difference over a thousandth of the depth.
        let step_m = 1e-3 * high.depth_m();
        let beyond = self.sample(high.depth_m() + step_m, &high.settled)?;
        let next = beyond
            .roots
            .iter()
            .map(|root| (root - crossed).norm())
            .zip(&beyond.roots)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(crossed.norm(), |(_, root)| root.norm());
        let slope = (next - crossed.norm()).abs() / step_m;
        let error_m = if error < slope * last_m {
            error / slope
        } else {
            last_m
        };
        Ok(Switch {
            depth_mm: 0.5e3 * (low.depth_m() + high.depth_m()),
            error_mm: Some(1e3 * error_m),
            kind: StabilityLoss::of(crossed),
            gain,
            chatter_hz,
        })
    }
}

/// Units of the equivalent springs, by axis, that scale constant force, stiffness and damping to one order of magnitude
/// for the fixed-point iteration.
struct Units([[f64; 3]; 3]);

impl Units {
    fn new(problem: &EquivalentProblem, samples: &Samples, period_s: f64) -> Self {
        let length_m = samples.largest_m().max(f64::MIN_POSITIVE);
        let seconds = period_s / std::f64::consts::TAU;
        Self(
            problem
                .stiffness
                .map(|stiffness| [stiffness * length_m, stiffness, stiffness * seconds]),
        )
    }

    fn vector(&self, springs: &[Spring; 3]) -> DVector<f64> {
        let values = springs.iter().zip(&self.0).flat_map(|(spring, units)| {
            [spring.force_n, spring.stiffness, spring.damping]
                .into_iter()
                .zip(*units)
                .map(|(value, unit)| if unit > 0.0 { value / unit } else { 0.0 })
        });
        DVector::from_iterator(9, values)
    }

    fn springs(&self, vector: &DVector<f64>, most_damping: [f64; 3]) -> [Spring; 3] {
        std::array::from_fn(|axis| {
            let value = |which: usize| vector[3 * axis + which] * self.0[axis][which];
            Spring {
                force_n: value(0),
                stiffness: value(1),
                damping: value(2).clamp(0.0, most_damping[axis]),
            }
        })
    }
}

impl Method for EquivalentProblem {
    fn name(&self) -> &'static str {
        "collocation about the forced orbit, with equivalent stiffness and damping of non-smooth forces"
    }

    /// Evaluates the orbit that is reached when the depth grows from 0. The error is the distance of the multiplier
    /// from that with the stiffness and damping that a small disturbance of the orbit sees.
    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        let follower = Follower::new(self, rpm);
        let last_m = 1e-3 * depth_mm.max(NONE_MM);
        let mut settled = follower.rest();
        // The depth grows from 0 to the requested one in a few steps, so that the orbit of lower amplitude is found if
        // two exist.
        for share in [1e-2, 0.1, 0.3, 0.6, 0.8, 1.0] {
            settled = follower.settle((share * last_m).max(1e-3 * NONE_MM), &settled)?;
        }
        let sample = Sample {
            roots: follower.roots(&settled.springs, &settled.orbit)?,
            settled,
        };
        let root = sample.roots.first().copied().unwrap_or_default();
        let chatter_hz = follower.chatter_hz(&sample, root);
        let error = follower.error(&sample, root, chatter_hz)?;
        Ok(CutStability::new(rpm, depth_mm, root, error, chatter_hz))
    }

    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        let follower = Follower::new(self, rpm);
        let last_m = 1e-3 * depth_mm;
        let samples = samples.max(EQUIVALENT_SAMPLES_MIN);
        let none_m = (1e-3 * NONE_MM).min(last_m / samples as f64);
        let mut low = follower.sample(none_m, &follower.rest())?;
        let start = low.outside();
        let mut switches = Vec::new();
        for index in 1..=samples {
            let depth_m = last_m * index as f64 / samples as f64;
            let high = follower.sample(depth_m, &low.settled)?;
            switches.extend(follower.between(&low, &high, last_m)?);
            low = high;
        }
        Ok(SpeedLine::of_switches(rpm, depth_mm, start, switches))
    }
}
