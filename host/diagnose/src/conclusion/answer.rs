//! The answer of a diagnosis, as JSON has it.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::conclusion::lobes::{Chart, Lobes};
use crate::conclusion::residual_views::ResidualView;

/// A normal deviate is within this many deviations with 90 %.
pub(crate) const NINETY_PERCENT: f64 = 1.644_853_626_951_472_6;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The causes are named.
    Cause,
    /// The model is right within the noise.
    None,
    /// Several causes explain the records equally well.
    Confounded,
    /// Something is wrong that no known cause explains.
    Unexplained,
}

/// A value and its 90 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// The value, in the unit of its key.
    pub value: f64,
    /// Its 90 % interval.
    pub ci90: [f64; 2],
}

/// A cause with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EstimatedCause {
    /// Its name, as in `[extension.NAME]`.
    pub name: &'static str,
    /// How sure it is, 0 to 1.
    pub confidence: f64,
    /// The direction that it acts in, where it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<&'static str>,
    /// The directions that it joins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub directions: Option<[&'static str; 2]>,
    /// The channel that it acts in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Parameters by key.
    pub parameters: BTreeMap<&'static str, Figure>,
    /// The table `[extension.NAME]` that makes it part of a case.
    #[serde(skip)]
    pub extension: toml::Table,
    /// Which cause of its explanation it belongs to: one that acts along two directions stands in the answer twice.
    #[serde(skip)]
    pub choice: usize,
    /// The same table with one principal direction of what was fitted at either end of its 90 % interval.
    #[serde(skip)]
    pub moved: Vec<[toml::Table; 2]>,
}

impl EstimatedCause {
    /// Its direction, directions or channel, as far as it has them.
    pub fn location(&self) -> String {
        let directions = self.directions.map(|[one, other]| format!("{one} and {other}"));
        let channel = self.channel.clone();
        channel
            .or(self.direction.map(String::from))
            .or(directions)
            .unwrap_or_default()
    }
}

/// The causes of one explanation, each with its channel or directions: `mass along x with sensor-gain of ax`.
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

/// How well a model predicts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Root mean square of the residual over that of the channels, on held-out parts of records; every channel counts alike.
    pub nrmse_heldout: f64,
    /// The same of the whole records.
    pub nrmse_whole: f64,
}

/// What the extension gains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Share of the held-out residual's energy beyond that of the noise that the extension removes: 1 − (E_after − n)/(E_before − n), with
    /// energies in units of the noise and n numbers that are compared; −1 where it is that or less.
    pub residual_energy_removed: f64,
    /// Its 90 % interval: of the same machine, with the noise drawn anew. It ends at −1, where twice as much is left: less is not told
    /// apart, and where hardly more than noise was held out nothing is.
    pub ci90: [f64; 2],
}

impl Gain {
    /// Of what the case and the extended case leave of `count` numbers, in units of the noise.
    ///
    /// Each energy is that of a signal s² in noise: a non-central χ² with variance 2n + 4s². The noise of both is the same; they are
    /// taken as independent, which makes the interval wider where both leave much.
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

/// What is left.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unexplained {
    /// Share of the residual's energy that is neither explained nor noise.
    pub fraction: f64,
    /// Where it sits.
    #[serde(rename = "where")]
    pub location: String,
    /// A formula for it, which is a guess.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guess: Option<String>,
}

/// The experiment that would tell more.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextTest {
    /// What kind of recording.
    pub kind: &'static str,
    /// The direction of the force, of a test of the structure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<&'static str>,
    /// Amplitudes of the force, one after the other, N; of a blow its peak.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub force_n: Vec<f64>,
    /// Where a sweep begins and ends, or the frequency of a step twice, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_hz: Option<[f64; 2]>,
    /// Of a cut: spindle speed, rev/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spindle_rpm: Option<f64>,
    /// Of a cut: axial depth, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_depth_mm: Option<f64>,
    /// Of a cut: feed per tooth, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_per_tooth_mm: Option<f64>,
    /// How long it is recorded, s.
    pub seconds: f64,
    /// What must be measured besides the channels of the records.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measure: Option<&'static str>,
    /// How far apart the explanations would be that it separates least, in standard deviations: about 8 tell nearly always.
    pub distance: f64,
    /// What it separates, and how.
    pub why: String,
}

impl NextTest {
    /// What to do, in a sentence without its end.
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

/// The answer.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// What was found.
    pub outcome: Outcome,
    /// How well the case predicts.
    pub baseline: Quality,
    /// The causes, the surest first; where they are confounded, all of the set.
    pub causes: Vec<EstimatedCause>,
    /// Names that mean the same on these records.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equivalent: Vec<Vec<&'static str>>,
    /// How well the extended case predicts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extended: Option<Quality>,
    /// What the extension gains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain: Option<Gain>,
    /// What is left.
    pub unexplained: Unexplained,
    /// What it changes of the limits; `None` where nothing was found, or limits cannot be computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lobes: Option<Lobes>,
    /// The lobes of the case with the cuts that are known, where nothing was found.
    #[serde(skip)]
    pub believed: Option<Chart>,
    /// What would tell more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_test: Option<NextTest>,
    /// What should be known about the records.
    pub warnings: Vec<String>,
    /// The explanations that are left, each with all its causes, which act together: more than one where the answer is `Confounded`.
    #[serde(skip_serializing_if = "is_single")]
    pub explanations: Vec<Vec<EstimatedCause>>,
    /// How many of `causes`, from the first, act together in the extended case.
    #[serde(skip)]
    pub acting: usize,
    /// The residuals, channel by channel.
    #[serde(skip)]
    pub views: Vec<ResidualView>,
}

/// Nothing that `causes` does not say.
fn is_single(explanations: &[Vec<EstimatedCause>]) -> bool {
    explanations.len() < 2
}

impl Diagnosis {
    /// Adds causes that explain the records together as well as those that act: each name once, or where it is the same names at
    /// `other_places`, each place once.
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

    /// The explanations that are left, in words: each with all that must act together.
    pub fn alternatives(&self) -> String {
        let labels: Vec<String> = self.explanations.iter().map(|causes| label(causes)).collect();
        labels.join("; or ")
    }

    /// The names of the causes, each once: a cause that acts along several directions stands in the answer once for each.
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
    fn a_gain_is_said_where_there_is_one_to_be_measured() {
        // Of 1 000 numbers: twice their noise before, and noise after.
        let gain = Gain::new(2000.0, 1000.0, 1000.0);
        assert_eq!(gain.residual_energy_removed, 1.0);
        // √(2 000)/1 000 after, and as much of what was there before: 1.645·0.0447.
        assert!(
            (gain.ci90[0] - 0.926).abs() < 1e-3 && gain.ci90[1] == 1.0,
            "{gain:?}"
        );
        // Nothing but noise before: whatever is removed, it is not known.
        let gain = Gain::new(990.0, 980.0, 1000.0);
        assert_eq!(gain.ci90, [-1.0, 1.0]);
        assert_eq!(Gain::new(1001.0, 1500.0, 1000.0).residual_energy_removed, -1.0);
    }
}
