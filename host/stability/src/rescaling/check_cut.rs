//! Factor of the natural frequency of the mode that chattered in one cut.

use quietcut_model::case::Case;
use quietcut_model::structure::Form;
use quietcut_numerics::statistics::NINETY_PERCENT;
use rayon::prelude::*;
use serde::Serialize;

use crate::criteria::{LARGEST_RESCALING, RESCALING_STEP, RIVAL_RESCALING};
use crate::limits::point::CutStability;
use crate::limits::uncertainty::MethodOfCase;
use crate::spectrum::stability_loss::StabilityLoss;
use crate::spectrum::verdict::Verdict;
use crate::trial_cuts::{Outcome, TrialCut};

/// Bisections of a step of the factor: to 1e-8 of the factor.
const BISECTIONS: usize = 20;

/// Largest difference of predicted and measured frequency at a root, relative. The last bisection is 1e-8 wide and
/// chatter frequencies move less than ten times as fast as natural ones; at a jump from one lobe to another they differ by far more.
const ROOT: f64 = 1e-6;

/// Relative step of a natural frequency for the derivative of the chatter frequency; the frequency of a smooth lobe is
/// parabolic over it to 1e-6.
const DERIVATIVE_STEP: f64 = 1e-3;

/// A cut whose chatter frequency was measured, and what it says about the mode that chattered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckCut {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Measured chatter frequency, Hz; `None` if it was not measured or the cut was stable.
    pub chatter_hz: Option<f64>,
    /// Number of the mode that chattered, from 1; `None` if the cut does not identify it.
    pub mode: Option<usize>,
    /// Factor of the natural frequency of this mode with which the dominant Floquet multiplier of the cut has the measured frequency;
    /// `None` likewise.
    pub factor: Option<f64>,
    /// Standard deviation of the factor from the error of the measured frequency; `None` likewise.
    pub factor_std: Option<f64>,
    /// |μ| of the dominant multiplier with the factors that all cuts give together: below 1 the cut is predicted stable although it
    /// chattered; `None` likewise.
    pub multiplier_abs: Option<f64>,
    /// Reason why the cut identifies no factor; `None` if it does.
    pub reason: Option<String>,
}

/// A factor of one mode that explains the measured frequency.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    mode: usize,
    factor: f64,
    std: f64,
    point: CutStability,
}

impl Candidate {
    fn distance(&self) -> f64 {
        self.factor.ln().abs()
    }
}

/// What the prediction says over the natural frequency of one mode.
struct Scan {
    /// The factor that explains the measured frequency.
    candidate: Option<Candidate>,
    /// True if with some factor the cut is predicted to lose stability by period doubling.
    doubles_its_period: bool,
}

/// The prediction for one cut, with other natural frequencies of the case.
struct Prediction<'a> {
    case: &'a Case,
    method_of: &'a MethodOfCase<'a>,
    cut: &'a TrialCut,
    chatter_hz: f64,
    modes: usize,
    /// Standard deviation of the measured frequency, relative.
    error: f64,
}

impl CheckCut {
    pub(super) fn new(case: &Case, method_of: &MethodOfCase<'_>, cut: &TrialCut, error: f64) -> Self {
        let mut check = Self {
            rpm: cut.rpm,
            depth_mm: cut.depth_mm,
            chatter_hz: cut.chatter_hz,
            mode: None,
            factor: None,
            factor_std: None,
            multiplier_abs: None,
            reason: None,
        };
        match identified(case, method_of, cut, error) {
            Ok(found) => {
                check.mode = Some(found.mode + 1);
                check.factor = Some(found.factor);
                check.factor_std = Some(found.std);
                check.multiplier_abs = Some(found.point.multiplier_abs);
            }
            Err(reason) => check.reason = Some(reason),
        }
        check
    }
}

fn identified(
    case: &Case,
    method_of: &MethodOfCase<'_>,
    cut: &TrialCut,
    error: f64,
) -> Result<Candidate, String> {
    match cut.outcome {
        Outcome::Chatter => (),
        Outcome::Stable => return Err("it did not chatter".into()),
        Outcome::Marginal => return Err("its outcome is marginal, not chatter".into()),
    }
    let Some(chatter_hz) = cut.chatter_hz else {
        return Err("its chatter frequency was not measured (column chatter_hz)".into());
    };
    let modes = match case.structure.as_ref().map(|structure| &structure.form) {
        Some(Form::Modes(modes)) => modes.len(),
        _ => 0,
    };
    // A method that refuses the case refuses it with every factor.
    method_of(case)?;
    let prediction = Prediction {
        case,
        method_of,
        cut,
        chatter_hz,
        modes,
        error,
    };
    let scans: Vec<Scan> = (0..modes)
        .into_par_iter()
        .map(|mode| prediction.scan(mode))
        .collect();
    if is_half_order(case, cut.rpm, chatter_hz, error) && scans.iter().any(|scan| scan.doubles_its_period) {
        return Err(format!(
            "{chatter_hz} Hz is, within its error of {} %, an odd multiple of half the tooth-passing frequency, and with other natural \
             frequencies the cut is predicted to double its period, whose frequency does not depend on the structure; cut at another \
             speed, or measure the frequency more exactly (--chatter-error-percent)",
            100.0 * error
        ));
    }
    let mut found: Vec<Candidate> = scans.into_iter().filter_map(|scan| scan.candidate).collect();
    if found
        .iter()
        .any(|candidate| candidate.point.verdict == Verdict::Unstable)
    {
        found.retain(|candidate| candidate.point.verdict == Verdict::Unstable);
    }
    found.sort_by(|a, b| a.distance().total_cmp(&b.distance()));
    let Some(best) = found.first().copied() else {
        return Err(format!(
            "no natural frequency up to {:.0} % higher or {:.0} % lower gives the chatter frequency of {chatter_hz} Hz",
            100.0 * (LARGEST_RESCALING - 1.0),
            100.0 * (1.0 - LARGEST_RESCALING.recip())
        ));
    };
    if let Some(rival) = found.get(1)
        && rival.distance() <= RIVAL_RESCALING * best.distance() + NINETY_PERCENT * (best.std + rival.std)
    {
        return Err(format!(
            "mode {} with its natural frequency multiplied by {:.4} explains the chatter frequency of {chatter_hz} Hz, and mode {} \
             multiplied by {:.4} does so as well",
            best.mode + 1,
            best.factor,
            rival.mode + 1,
            rival.factor
        ));
    }
    if NINETY_PERCENT * best.std / best.factor > LARGEST_RESCALING.ln() {
        return Err(format!(
            "its chatter frequency hardly depends on the natural frequency of mode {}: the standard deviation of the factor would be {:.0} %",
            best.mode + 1,
            100.0 * best.std / best.factor
        ));
    }
    Ok(best)
}

/// True if a frequency is, within 90 % of its error, an odd multiple of half the tooth-passing frequency.
fn is_half_order(case: &Case, rpm: f64, chatter_hz: f64, error: f64) -> bool {
    let Some(tool) = &case.tool else { return false };
    let half_hz = 0.5 * tool.teeth as f64 * rpm / 60.0;
    let order = 2.0 * ((0.5 * (chatter_hz / half_hz - 1.0)).round()) + 1.0;
    (chatter_hz - order * half_hz).abs() < NINETY_PERCENT * error * chatter_hz
}

impl Prediction<'_> {
    /// Stability of the cut with the natural frequency of one mode multiplied by `factor`, and that of another by `other`.
    fn point(&self, mode: usize, factor: f64, other: Option<(usize, f64)>) -> Option<CutStability> {
        let mut case = self.case.clone();
        if let Some(Form::Modes(modes)) = case.structure.as_mut().map(|structure| &mut structure.form) {
            for (index, factor) in [Some((mode, factor)), other].into_iter().flatten() {
                let scaled = modes.get(index)?.with_frequency_scaled(factor);
                modes[index] = scaled;
            }
        }
        (self.method_of)(&case)
            .ok()?
            .point(self.cut.rpm, self.cut.depth_mm)
            .ok()
    }

    /// ln of the predicted over the measured chatter frequency.
    fn excess_of(&self, point: &CutStability) -> Option<f64> {
        Some((point.chatter_hz? / self.chatter_hz).ln())
    }

    fn excess(&self, mode: usize, factor: f64) -> Option<f64> {
        self.excess_of(&self.point(mode, factor, None)?)
    }

    /// The prediction over the natural frequency of a mode.
    fn scan(&self, mode: usize) -> Scan {
        let steps = (LARGEST_RESCALING.ln() / RESCALING_STEP).ceil() as i32;
        let scanned: Vec<(f64, Option<CutStability>)> = (-steps..=steps)
            .into_par_iter()
            .map(|step| {
                let factor = (RESCALING_STEP * f64::from(step)).exp();
                (factor, self.point(mode, factor, None))
            })
            .collect();
        let doubles =
            |point: &CutStability| point.kind == StabilityLoss::Flip && point.verdict == Verdict::Unstable;
        Scan {
            doubles_its_period: scanned
                .iter()
                .any(|(_, point)| point.as_ref().is_some_and(doubles)),
            candidate: self.candidate(mode, &scanned),
        }
    }

    /// Factor of the mode nearest to 1 that explains the measured frequency by a Hopf multiplier on which this mode has more
    /// effect than any other; one that is predicted unstable goes before one that is not. `None` if there is none.
    fn candidate(&self, mode: usize, scanned: &[(f64, Option<CutStability>)]) -> Option<Candidate> {
        let excess = |point: &Option<CutStability>| self.excess_of(point.as_ref()?);
        let mut found: Vec<Candidate> = scanned
            .windows(2)
            .filter_map(|pair| {
                let ends = [excess(&pair[0].1)?, excess(&pair[1].1)?];
                let factor = self.root(mode, [pair[0].0, pair[1].0], ends)?;
                self.at_root(mode, factor)
            })
            .collect();
        let is_unstable = |candidate: &Candidate| candidate.point.verdict == Verdict::Unstable;
        if found.iter().any(is_unstable) {
            found.retain(is_unstable);
        }
        found
            .into_iter()
            .min_by(|a, b| a.distance().total_cmp(&b.distance()))
    }

    /// Root of the excess between two factors; `None` if its sign does not change, or if it jumps.
    fn root(&self, mode: usize, [mut low, mut high]: [f64; 2], [below, above]: [f64; 2]) -> Option<f64> {
        if below * above > 0.0 {
            return None;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.excess(mode, middle)? * below > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let root = 0.5 * (low + high);
        (self.excess(mode, root)?.abs() < ROOT).then_some(root)
    }

    fn at_root(&self, mode: usize, factor: f64) -> Option<Candidate> {
        let point = self.point(mode, factor, None)?;
        if point.kind != StabilityLoss::Hopf {
            return None;
        }
        let own = self.slope(mode, factor, mode)?;
        for other in (0..self.modes).filter(|other| *other != mode) {
            if self.slope(mode, factor, other)?.abs() > own.abs() {
                return None;
            }
        }
        Some(Candidate {
            mode,
            factor,
            std: factor * self.error / own.abs(),
            point,
        })
    }

    /// Derivative of the logarithm of the chatter frequency by that of the natural frequency of a mode, with `mode` at
    /// `factor`.
    fn slope(&self, mode: usize, factor: f64, by: usize) -> Option<f64> {
        let at = |share: f64| -> Option<f64> {
            let point = if by == mode {
                self.point(mode, factor * share, None)
            } else {
                self.point(mode, factor, Some((by, share)))
            };
            Some(point?.chatter_hz?.ln())
        };
        let (low, high) = (1.0 - DERIVATIVE_STEP, 1.0 + DERIVATIVE_STEP);
        Some((at(high)? - at(low)?) / (high / low).ln())
    }
}
