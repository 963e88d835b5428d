//! Test oracle: which causes a set of records can separate, from the distance, in units of the noise, between the hidden effect and the
//! best fit of every other cause.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use super::cause::{Cause, EffectKind, OF_OWN_FAMILY};
use super::noise::Whitening;

/// Squared distance (χ²) below which two causes cannot be separated.
const SAME: f64 = 2.0;
/// Squared distance from which on a good test separates two causes nearly always: the difference of twice the log-likelihoods of two
/// candidate models at distance d is d² ± 2d.
const APART: f64 = 60.0;

/// Conclusion of the oracle, which knows the true effect, from a set of records.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// No other cause explains the records as well.
    Separable,
    /// Exactly these names explain the records equally well. One name alone means the same cause at several locations.
    Equivalent(BTreeSet<&'static str>),
    /// The records do not show the effect.
    Invisible,
    /// Chance decides whether the records show or separate the effect.
    Borderline,
}

/// Readings by run, sensor and sample.
pub(crate) type Output = Vec<Vec<Vec<f64>>>;

/// A virtual test or cut in which effects can act.
pub(crate) trait Lab {
    /// Readings of all sensors without noise while `causes` act.
    fn output(&self, causes: &[Cause]) -> Output;

    /// Locations that an effect can have: direction and sensor.
    fn places(&self, kind: EffectKind) -> Vec<(usize, usize)>;

    /// Effects of the library that can act in this test.
    fn kinds(&self) -> Vec<EffectKind>;

    /// The effects among these that families without an effect of their own hide.
    fn drawn(&self) -> Vec<EffectKind> {
        let mut kinds = self.kinds();
        kinds.retain(|kind| !OF_OWN_FAMILY.contains(kind));
        kinds
    }

    /// Names that an effect has in answers about this test.
    fn names(&self, kind: EffectKind) -> &'static [&'static str] {
        kind.names()
    }

    /// Contributions of the unknown initial state to the readings, run by run and sensor by sensor. Each is one column in units of `sigma`;
    /// the columns are not orthonormal.
    fn nuisance(&self, sigma: &[f64]) -> DMatrix<f64>;

    /// True for free decays, whose initial displacement is unknown.
    fn is_free_decay(&self) -> bool {
        false
    }

    /// Noise that measured forces add to the predicted motion, in addition to `sigma`; `None` if they add none.
    fn whitening(&self, _sigma: &[f64]) -> Option<Whitening> {
        None
    }
}

/// The test oracle for one set of records.
pub(crate) struct Oracle<'a> {
    lab: &'a dyn Lab,
    /// Standard deviation of each sensor's noise.
    sigma: &'a [f64],
    /// Orthonormal columns: contributions of the unknown initial state.
    nuisance: DMatrix<f64>,
    whitening: Option<Whitening>,
}

impl<'a> Oracle<'a> {
    /// Builds the oracle; `sigma` is the standard deviation of each sensor's noise.
    pub(crate) fn new(lab: &'a dyn Lab, sigma: &'a [f64]) -> Self {
        Self::of_starts(lab, sigma, &[])
    }

    /// Builds an oracle for which, in free decays under the causes `hidden`, the initial amplitude of each run is unknown as well.
    fn of_starts(lab: &'a dyn Lab, sigma: &'a [f64], hidden: &[Cause]) -> Self {
        let mut nuisance = lab.nuisance(sigma);
        if lab.is_free_decay() && !hidden.is_empty() {
            let output = lab.output(hidden);
            let length = nuisance.nrows() / output.len();
            for (number, run) in output.iter().enumerate() {
                let values = run
                    .iter()
                    .zip(sigma)
                    .flat_map(|(samples, sigma)| samples.iter().map(move |value| value / sigma));
                let column = nuisance.ncols();
                nuisance = nuisance.insert_column(column, 0.0);
                let mut rows = nuisance.column_mut(column);
                for (row, value) in rows.rows_range_mut(number * length..).iter_mut().zip(values) {
                    *row = value;
                }
            }
        }
        let whitening = lab.whitening(sigma);
        if let Some(whitening) = &whitening {
            for mut column in nuisance.column_iter_mut() {
                whitening.apply(column.as_mut_slice());
            }
        }
        if nuisance.ncols() > 0 {
            for mut column in nuisance.column_iter_mut() {
                let norm = column.norm();
                column /= norm;
            }
            nuisance = nuisance.qr().q();
        }
        Self {
            lab,
            sigma,
            nuisance,
            whitening,
        }
    }

    /// All readings of an output as one column, in units of the noise and whitened.
    fn whitened(&self, output: &Output) -> DVector<f64> {
        let values = output.iter().flat_map(|run| {
            run.iter()
                .zip(self.sigma)
                .flat_map(|(samples, sigma)| samples.iter().map(move |value| value / sigma))
        });
        let mut all = DVector::from_iterator(output.iter().flatten().map(Vec::len).sum(), values);
        if let Some(whitening) = &self.whitening {
            whitening.apply(all.as_mut_slice());
        }
        all
    }

    /// Standard deviation of all noise in each sensor's residual: its own and that of the predicted motion.
    pub(crate) fn noise(&self) -> Vec<f64> {
        match &self.whitening {
            Some(whitening) => self
                .sigma
                .iter()
                .zip(&whitening.growth)
                .map(|(s, g)| s * g)
                .collect(),
            None => self.sigma.to_vec(),
        }
    }

    /// Whitened readings without noise while `causes` act.
    pub(crate) fn of(&self, causes: &[Cause]) -> DVector<f64> {
        self.whitened(&self.lab.output(causes))
    }

    fn without_nuisance(&self, mut value: DVector<f64>) -> DVector<f64> {
        if self.nuisance.ncols() == 0 {
            return value;
        }
        let share = self.nuisance.tr_mul(&value);
        value.gemv(-1.0, &self.nuisance, &share, 1.0);
        value
    }

    /// Fits `wanted` to the readings `truth`, starting from its parameters: the χ² that remains, and the fitted causes.
    pub(crate) fn nearest(&self, truth: &DVector<f64>, wanted: &[Cause]) -> (f64, Vec<Cause>) {
        let residual = |causes: &[Cause]| self.without_nuisance(truth - self.of(causes));
        let mut best = wanted.to_vec();
        let mut left = residual(&best);
        let mut trust = 1e-3;
        for round in 0..12 {
            let before = left.norm_squared();
            let jacobian = jacobian(&best, &left, &residual);
            let (normal, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&left));
            if round == 0
                && let Some(step) = normal.clone().lu().solve(&gradient)
            {
                // To first order most of the difference cannot be fitted: the search stops.
                let least = before - gradient.dot(&step);
                if least > 0.5 * before && least > 100.0 * APART {
                    return (least, best);
                }
            }
            let mut accepted = false;
            for _ in 0..5 {
                let mut damped = normal.clone();
                for i in 0..damped.nrows() {
                    damped[(i, i)] *= 1.0 + trust;
                }
                let Some(step) = damped.lu().solve(&gradient) else {
                    break;
                };
                let mut next = best.clone();
                let shares = next.iter_mut().flat_map(|cause| cause.shares.iter_mut());
                for (share, step) in shares.zip(step.iter()) {
                    // A scaled parameter is about one for a clear effect: a step is at most one.
                    *share -= step.clamp(-1.0, 1.0);
                }
                if next.iter().all(Cause::sensible) {
                    let after = residual(&next);
                    if after.norm_squared() < before {
                        (best, left) = (next, after);
                        trust *= 0.1;
                        accepted = true;
                        break;
                    }
                }
                trust = trust.max(1e-3) * 10.0;
            }
            let now = left.norm_squared();
            // The fit is far from the records and converges too slowly.
            let hopeless = now > 3.0 * APART && now > 0.9 * before
                || round > 1 && now > 100.0 * APART && now > 0.5 * before;
            if !accepted || hopeless || now < 0.1 * SAME || before - now < 0.01 {
                break;
            }
        }
        (left.norm_squared(), best)
    }

    /// Start values of an effect at all its locations.
    pub(crate) fn candidates(&self, kind: EffectKind, random: &mut ChaCha8Rng) -> Vec<Cause> {
        let mut all = Vec::new();
        for (axis, sensor) in self.lab.places(kind) {
            for shares in kind.starts(random) {
                all.push(Cause {
                    kind,
                    axis,
                    sensor,
                    shares,
                });
            }
        }
        all
    }

    /// Effects that may resemble the hidden one: those of the library and, for gains, the common factors that are exactly equivalent.
    fn rivals_of(&self, hidden: &Cause) -> Vec<EffectKind> {
        let mut kinds = self.lab.kinds();
        if matches!(hidden.kind, EffectKind::SensorGain | EffectKind::SensorOffset) {
            kinds.extend([EffectKind::CommonFactor, EffectKind::CommonForce]);
        }
        kinds
    }

    /// χ² of the hidden effects: squared distance between the readings with and without them.
    pub(crate) fn effect(&self, hidden: &[Cause]) -> f64 {
        self.without_nuisance(self.of(hidden) - self.of(&[]))
            .norm_squared()
    }

    /// χ² of the hidden effects that remains after the best fit of single causes and pairs of the library.
    pub(crate) fn unexplained(&self, hidden: &[Cause], random: &mut ChaCha8Rng) -> f64 {
        let truth = self.of(hidden);
        let mut singles: Vec<(f64, Vec<Cause>)> = Vec::new();
        for kind in self.lab.kinds() {
            let fits = self
                .candidates(kind, random)
                .into_iter()
                .map(|start| self.nearest(&truth, &[start]));
            singles.extend(fits.min_by(|a, b| a.0.total_cmp(&b.0)));
        }
        singles.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut least = singles.first().map_or(f64::INFINITY, |single| single.0);
        let best: Vec<&Cause> = singles.iter().take(4).map(|(_, causes)| &causes[0]).collect();
        for (i, first) in best.iter().enumerate() {
            for second in &best[i + 1..] {
                let pair = [(*first).clone(), (*second).clone()];
                least = least.min(self.nearest(&truth, &pair).0);
            }
        }
        least
    }

    /// Conclusion for two causes. They are separable if no other cause can replace either of them.
    pub(crate) fn verdict_of_two(&self, hidden: &[Cause; 2], random: &mut ChaCha8Rng) -> Verdict {
        let oracle = Self::of_starts(self.lab, self.sigma, hidden);
        let truth = oracle.of(hidden);
        for (gone, stays) in [(0, 1), (1, 0)] {
            let alone = oracle.nearest(&truth, &hidden[stays..=stays]).0;
            if alone < APART {
                return Verdict::Borderline;
            }
            for kind in oracle.rivals_of(&hidden[gone]) {
                if kind == hidden[stays].kind || kind.parameters() > hidden[gone].kind.parameters() {
                    continue;
                }
                let starts = oracle
                    .candidates(kind, random)
                    .into_iter()
                    .chain(stand_in(kind, &hidden[gone]))
                    .filter(|candidate| !candidate.is_where(&hidden[gone]))
                    .map(|candidate| [candidate, hidden[stays].clone()]);
                for start in starts.chain(by_common_factor(kind, &hidden[gone], &hidden[stays])) {
                    if oracle.nearest(&truth, &start).0 < APART {
                        return Verdict::Borderline;
                    }
                }
            }
        }
        Verdict::Separable
    }

    /// Conclusion for one cause, from the records alone.
    pub(crate) fn verdict(&self, hidden: &Cause, random: &mut ChaCha8Rng) -> Verdict {
        let effect = self.effect(std::slice::from_ref(hidden));
        if effect < SAME {
            return Verdict::Invisible;
        }
        if effect < APART {
            return Verdict::Borderline;
        }
        let truth = self.of(std::slice::from_ref(hidden));
        let mut same: BTreeSet<&'static str> = hidden.kind.names().iter().copied().collect();
        // True if the same effect in another direction or sensor is equivalent.
        let mut elsewhere = false;
        for kind in self.rivals_of(hidden) {
            if kind.parameters() > hidden.kind.parameters() {
                continue;
            }
            for candidate in self
                .candidates(kind, random)
                .into_iter()
                .chain(stand_in(kind, hidden))
            {
                if candidate.is_where(hidden) {
                    continue;
                }
                let (left, _) = self.nearest(&truth, &[candidate]);
                if left < APART && kind.parameters() < hidden.kind.parameters() {
                    // A simpler cause explains the records as well and would be preferred.
                    return Verdict::Borderline;
                }
                if left < SAME {
                    elsewhere |= kind == hidden.kind;
                    same.extend(self.lab.names(kind));
                } else if left < APART {
                    return Verdict::Borderline;
                }
            }
        }
        if same.len() == hidden.kind.names().len() && !elsewhere {
            Verdict::Separable
        } else {
            Verdict::Equivalent(same)
        }
    }
}

/// Start value of a simpler effect that resembles the hidden one at small amplitude: within its gap, backlash is a reduced stiffness.
fn stand_in(kind: EffectKind, hidden: &Cause) -> Option<Cause> {
    (kind == EffectKind::Stiffness && hidden.kind == EffectKind::Backlash).then(|| Cause {
        kind,
        shares: vec![-10.0 * hidden.shares[1]],
        ..hidden.clone()
    })
}

/// Two changes among mass, stiffness and damping in the direction of the hidden two, of which one is `kind`. They differ from the hidden
/// two by a common factor on the equation of motion, so that free decays are equal.
fn by_common_factor(kind: EffectKind, gone: &Cause, stays: &Cause) -> Option<[Cause; 2]> {
    let size = |kind: EffectKind| match kind {
        EffectKind::Mass | EffectKind::Stiffness => Some(0.1),
        EffectKind::Damping => Some(0.3),
        _ => None,
    };
    if gone.axis != stays.axis || kind == gone.kind || kind == stays.kind {
        return None;
    }
    let factor = 1.0 / (1.0 + size(gone.kind)? * gone.shares[0]);
    let with = |kind: EffectKind, value: f64| {
        Some(Cause {
            kind,
            shares: vec![(value - 1.0) / size(kind)?],
            ..gone.clone()
        })
    };
    let stayed = 1.0 + size(stays.kind)? * stays.shares[0];
    Some([with(kind, factor)?, with(stays.kind, factor * stayed)?])
}

/// ∂residual/∂(scaled parameters) by finite differences.
fn jacobian(
    at: &[Cause],
    residual_there: &DVector<f64>,
    residual: &dyn Fn(&[Cause]) -> DVector<f64>,
) -> DMatrix<f64> {
    let columns: usize = at.iter().map(|cause| cause.shares.len()).sum();
    let mut jacobian = DMatrix::zeros(residual_there.len(), columns);
    let mut column = 0;
    for cause in 0..at.len() {
        for share in 0..at[cause].shares.len() {
            let mut moved = at.to_vec();
            let step = 1e-3 * moved[cause].shares[share].abs().max(0.05);
            moved[cause].shares[share] += step;
            jacobian.set_column(column, &((residual(&moved) - residual_there) / step));
            column += 1;
        }
    }
    jacobian
}

impl Cause {
    /// True for the same effect in the same direction and at the same sensor.
    fn is_where(&self, other: &Self) -> bool {
        self.kind == other.kind && self.axis == other.axis && self.sensor == other.sensor
    }

    /// False if the parameters of a fit are outside the range of real machines.
    pub(crate) fn sensible(&self) -> bool {
        let s = &self.shares;
        match self.kind {
            EffectKind::MissingMode => s[0] > 0.1 && (0.0005..0.3).contains(&s[1]) && s[2] > 0.5,
            EffectKind::SofteningHardening => s[0].abs() < 4.0 && s[1] > 0.2,
            EffectKind::JointFriction => (0.0..4.0).contains(&s[0]) && s[1] > 0.05 && s[1] <= 1.0,
            EffectKind::Stiffness => (-9.5..4.0).contains(&s[0]),
            EffectKind::Backlash => s[0] > 0.0 && s[0] < 2.0 && (0.0..0.95).contains(&s[1]),
            EffectKind::Hysteresis => s[1] > 0.01 && s[0].abs() < 0.9,
            EffectKind::ForceExponent => (0.0..2.0).contains(&s[0]) && (0.05..20.0).contains(&s[1]),
            EffectKind::SpeedFluctuation => s[1] > 0.01 && s[1] < 1.0,
            EffectKind::SensorOffsetByMode => s.iter().all(|share| share.abs() < 4.0),
            _ => s[0].abs() < 4.0,
        }
    }
}
