//! The answer of a diagnosis; JSON contains most of its fields.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::conclusion::lobes::{Chart, Lobes};
use crate::conclusion::places::Place;
use crate::conclusion::residual_views::ResidualView;
use crate::conclusion::updates::{BaselineUpdate, Posterior};

pub(crate) use quietcut_numerics::statistics::NINETY_PERCENT;

/// Outcome of a diagnosis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The causes are identified.
    Cause,
    /// The baseline agrees with the records within the noise.
    None,
    /// Several candidate models with different causes or locations explain the records equally well.
    Confounded,
    /// No candidate model explains enough of the residual.
    Unexplained,
    /// The baseline agrees with the records within the noise if parameters that its case states as uncertain are other than
    /// those of the case.
    Update,
}

/// An estimated quantity and its 90 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// The estimated value, in the unit that its key in `parameters` states.
    pub value: f64,
    /// Ends of the 90 % confidence interval of the estimated value, in the same unit.
    pub ci90: [f64; 2],
}

/// A cause with its estimated parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EstimatedCause {
    /// Name of the cause, as in `[extension.NAME]`.
    pub name: &'static str,
    /// Confidence that the cause is present, from 0 to 1.
    pub confidence: f64,
    /// Direction x, y or z in which the cause acts or, for a cross-axis error, which the channel also reads; `None` if
    /// there is no single one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<&'static str>,
    /// The two directions that the cause couples; `None` for a cause that couples none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub directions: Option<[&'static str; 2]>,
    /// Name of the channel in which the cause acts, if it is an error of one sensor; otherwise `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Parameters by key.
    pub parameters: BTreeMap<&'static str, Figure>,
    /// The table `[extension.NAME]` that adds the cause to a case.
    #[serde(skip)]
    pub extension: toml::Table,
    /// Index of the cause in its candidate model. If a cause has several entries, for example one for each direction,
    /// they have the same index.
    #[serde(skip)]
    pub choice: usize,
    /// The table `[extension.NAME]` with the parameters at both ends of a 90 % interval: one pair for each principal
    /// direction of the correlation of the fitted parameters.
    #[serde(skip)]
    pub moved: Vec<[toml::Table; 2]>,
}

impl EstimatedCause {
    /// Name of the cause's channel, otherwise its direction or directions in words; empty if it has none of them.
    pub fn location(&self) -> String {
        let directions = self.directions.map(|[one, other]| format!("{one} and {other}"));
        let channel = self.channel.clone();
        channel
            .or(self.direction.map(String::from))
            .or(directions)
            .unwrap_or_default()
    }
}

/// The causes of one candidate model in words, each with its channel or directions: `mass along x with sensor-gain of
/// ax`.
pub(crate) fn label(causes: &[EstimatedCause]) -> String {
    let mut names: Vec<String> = Vec::new();
    for cause in causes {
        let name = match (&cause.channel, cause.direction, cause.directions) {
            (Some(channel), ..) => format!("{} of {channel}", cause.name),
            (_, Some(direction), _) => format!("{} along {direction}", cause.name),
            (_, _, Some([one, other])) => format!("{} of {one} and {other}", cause.name),
            _ => cause.name.to_owned(),
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.join(" with ")
}

/// Prediction error of the baseline or of the extended case: that of the extended case is the one that its own diagnosis prints as
/// that of its baseline.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// NRMSE on the held-out segments: the ratio of the RMS residual of a channel in a segment to the RMS of the
    /// measured channel in its whole record, as root mean square over all channels and segments with equal weight.
    pub nrmse_heldout: f64,
    /// NRMSE on the whole records, each one segment; otherwise as `nrmse_heldout`.
    pub nrmse_whole: f64,
}

/// Reduction of the residual energy on the held-out segments by the extension; for a long record that is validated on
/// its rest, of the energy in the rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Share of this residual energy above the noise that the extension explains: 1 − (E_after − n)/(E_before − n),
    /// with the residual energies E before and after the extension in units of the noise variance, and the number n of
    /// compared values; limited to −1 to 1.
    pub residual_energy_removed: f64,
    /// 90 % interval of `residual_energy_removed`, from the variance of both residual energies by the noise. It is
    /// limited to −1, where the extension doubles the residual energy above the noise, and to 1. It is wide if the
    /// residual of the baseline is close to the noise.
    pub ci90: [f64; 2],
}

impl Gain {
    /// Computes the gain from the χ² `before` and `after` the extension, each over the same `count` compared values.
    ///
    /// Each χ² is that of a signal with energy s² in noise: non-central, with variance 2n + 4s². Both contain the same
    /// noise; treating it as independent widens the interval if both residuals are large.
    pub(crate) fn new(before: f64, after: f64, count: f64) -> Self {
        let there = (before - count).max(1e-9 * before);
        let left = (after - count) / there;
        let variance = |energy: f64| 2.0 * count + 4.0 * (energy - count).max(0.0);
        let deviation = (variance(after) + left * left * variance(before)).sqrt() / there;
        let removed = (1.0 - left).clamp(-1.0, 1.0);
        Self {
            residual_energy_removed: removed,
            ci90: [
                (removed - NINETY_PERCENT * deviation).max(-1.0),
                (removed + NINETY_PERCENT * deviation).clamp(-1.0, 1.0),
            ],
        }
    }
}

/// The unexplained residual.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unexplained {
    /// Share of the baseline's residual energy above the noise that the best candidate model does not explain; 0 if
    /// only noise is left.
    pub fraction: f64,
    /// Channel with the largest unexplained residual relative to its noise, in words, with the frequency and time at
    /// which the residual is largest; `none above noise` if only noise is left.
    #[serde(rename = "where")]
    pub location: String,
    /// The places that hold most of the residual above its noise, largest first; empty if only noise is left.
    pub places: Vec<Place>,
    /// A formula that may describe the unexplained restoring force: a guess; `None` unless the outcome is `Unexplained`
    /// and a formula explains enough.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guess: Option<String>,
}

/// The experiment that separates confounded candidate models, or comes nearest to it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextTest {
    /// Kind of the proposed test, in the words of a recording's sidecar.
    pub kind: &'static str,
    /// Direction of the exciting force of the proposed test, if it is a test of the structure; `None` for a cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<&'static str>,
    /// Force amplitudes of the proposed test, applied one after the other, N; for an impact the peak force; empty for a
    /// cut.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub force_n: Vec<f64>,
    /// First and last frequency of the proposed sweep, Hz; for a step sine both are the same; `None` for an impact or a
    /// cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_hz: Option<[f64; 2]>,
    /// Spindle speed of the proposed cut, rev/min; `None` for a test of the structure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spindle_rpm: Option<f64>,
    /// Axial depth of the proposed cut, mm; `None` for a test of the structure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_depth_mm: Option<f64>,
    /// Feed per tooth of the proposed cut, mm; `None` for a test of the structure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_per_tooth_mm: Option<f64>,
    /// Duration of the proposed test, s.
    pub seconds: f64,
    /// Quantities that the proposed test measures in addition to the channels of the present records; `None` if there
    /// are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measure: Option<&'static str>,
    /// Distance between the predictions of those two candidate models that the proposed test separates least, in
    /// standard deviations of the noise.
    pub distance: f64,
    /// In words: the two candidate models that the proposed test separates least, and the channel in which they differ
    /// most; if no test separates them reliably, the distance instead of the channel.
    pub why: String,
}

impl NextTest {
    /// The proposed test in words, as a phrase.
    pub fn what(&self) -> String {
        let list = |values: &[f64]| {
            let values: Vec<String> = values.iter().map(|value| format!("{value:.3}")).collect();
            values.join(", ")
        };
        let mut said = self.kind.to_owned();
        if let Some(direction) = self.direction {
            said += &format!(" along {direction}");
        }
        if !self.force_n.is_empty() {
            said += &format!(", {} N", list(&self.force_n));
        }
        match self.band_hz {
            Some([from, to]) if from == to => said += &format!(" at {from:.2} Hz"),
            Some([from, to]) => said += &format!(" from {from:.2} to {to:.2} Hz"),
            None => {}
        }
        if let (Some(rpm), Some(depth_mm)) = (self.spindle_rpm, self.axial_depth_mm) {
            said += &format!(" at {rpm:.0} rev/min, {depth_mm:.2} mm deep");
        }
        if let Some(feed) = self.feed_per_tooth_mm {
            said += &format!(", {feed:.3} mm per tooth");
        }
        said += &format!(", {:.1} s", self.seconds);
        if let Some(measure) = self.measure {
            said += &format!(", measuring also {measure}");
        }
        said
    }
}

/// The answer of a diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// Outcome of the diagnosis.
    pub outcome: Outcome,
    /// Prediction error of the baseline.
    pub baseline: Quality,
    /// The causes of the best candidate model; if the outcome is `Confounded`, followed by those that equivalent
    /// candidate models add.
    pub causes: Vec<EstimatedCause>,
    /// Parameters that the case states as uncertain and that the records move, with the causes acting.
    pub updates: Vec<BaselineUpdate>,
    /// Groups of names of causes that the records cannot separate; empty unless the outcome is `Confounded`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equivalent: Vec<Vec<&'static str>>,
    /// Prediction error of the extended case; `None` without an extension.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extended: Option<Quality>,
    /// Reduction of the residual energy by the extension; `None` without an extension.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain: Option<Gain>,
    /// The unexplained residual.
    pub unexplained: Unexplained,
    /// Effect of the extension on the stability limits, as [`lobes`](crate::lobes::lobes) computes it;
    /// [`diagnose`](crate::diagnose) leaves it `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lobes: Option<Lobes>,
    /// Stability lobes of the case without extension, with the trial cuts and recorded cuts, as
    /// [`baseline_lobes`](crate::lobes::baseline_lobes) computes them; [`diagnose`](crate::diagnose) leaves it `None`.
    #[serde(skip)]
    pub baseline_lobes: Option<Chart>,
    /// The experiment that separates the candidate models of `explanations`, or comes nearest to it; `None` if there
    /// are fewer than two, or if no experiment can be simulated with all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_test: Option<NextTest>,
    /// Remarks in words, for example on the records or on results that cannot be computed.
    pub warnings: Vec<String>,
    /// The best candidate model and those equivalent to it, each with the causes that act together: more than one if
    /// the outcome is `Confounded`, none if no candidate model is accepted.
    #[serde(skip_serializing_if = "is_single")]
    pub explanations: Vec<Vec<EstimatedCause>>,
    /// Number of entries of `causes`, from the first, that act together in the extended case; 0 without an extension.
    #[serde(skip)]
    pub acting: usize,
    /// The uncertain parameters of the case after the records, with the causes acting; `None` if the case states none, or the
    /// records were not compared with them.
    #[serde(skip)]
    pub posterior: Option<Posterior>,
    /// Measured samples and residuals, one view for each channel of each record: by record, then by channel.
    #[serde(skip)]
    pub views: Vec<ResidualView>,
}

/// True if `explanations` has no entry beyond the causes of the best candidate model, so that JSON omits it.
fn is_single(explanations: &[Vec<EstimatedCause>]) -> bool {
    explanations.len() < 2
}

impl Diagnosis {
    /// Adds an equivalent candidate model to `explanations`, if it is new, and its causes to `causes`. A cause already
    /// listed is skipped: one with the same name or, if `other_locations` is true, with the same name and location.
    pub(crate) fn add_rival(&mut self, causes: Vec<EstimatedCause>, other_locations: bool) {
        for cause in &causes {
            let is_known = self.causes.iter().any(|known| {
                let same_location = known.location() == cause.location();
                known.name == cause.name && (same_location || !other_locations)
            });
            if !is_known {
                self.causes.push(cause.clone());
            }
        }
        let who = |causes: &[EstimatedCause]| {
            let who = causes.iter().map(|cause| (cause.name, cause.location()));
            let mut who: Vec<_> = who.collect();
            who.sort_unstable();
            who
        };
        let is_new = self.explanations.iter().all(|known| who(known) != who(&causes));
        if is_new && !causes.is_empty() {
            self.explanations.push(causes);
        }
    }

    /// The equivalent candidate models in words, each with all its causes.
    pub fn alternatives(&self) -> String {
        let labels: Vec<String> = self.explanations.iter().map(|causes| label(causes)).collect();
        labels.join("; or ")
    }

    /// The names of the `causes`, each once, in their order.
    pub fn names(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for cause in &self.causes {
            if !names.contains(&cause.name) {
                names.push(cause.name);
            }
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_gain_is_wide_if_the_residual_is_noise() {
        // χ² of 1 000 values: twice the noise before, the noise after.
        let gain = Gain::new(2000.0, 1000.0, 1000.0);
        assert_eq!(gain.residual_energy_removed, 1.0);
        // The extension leaves no residual above the noise, so that only the energy after it scatters: 1 − 1.645·√(2·1
        // 000)/1 000 = 0.926.
        assert!(
            (gain.ci90[0] - 0.926).abs() < 1e-3 && gain.ci90[1] == 1.0,
            "{gain:?}"
        );
        // If the residual before the extension is noise alone, the explained share is unknown.
        let gain = Gain::new(990.0, 980.0, 1000.0);
        assert_eq!(gain.ci90, [-1.0, 1.0]);
        assert_eq!(Gain::new(1001.0, 1500.0, 1000.0).residual_energy_removed, -1.0);
    }
}
