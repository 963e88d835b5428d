//! The answer of a diagnosis, as JSON has it.

use std::collections::BTreeMap;

use serde::Serialize;

use super::lobes::Lobes;
use super::views::View;

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
pub struct NamedCause {
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
}

/// How well a model predicts what it was not fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Root mean square of the residual over that of the channels, on held-out records; every channel counts alike.
    pub nrmse_heldout: f64,
}

/// What the extension gains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Share of the held-out residual's energy beyond that of the noise that the extension removes.
    pub residual_energy_removed: f64,
}

/// What is left.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unexplained {
    /// Share of the residual's energy that is neither explained nor noise.
    pub fraction: f64,
    /// Where it sits.
    #[serde(rename = "where")]
    pub place: String,
    /// A formula for it, which is a guess.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guess: Option<String>,
}

/// The experiment that would tell more.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextTest {
    /// What kind of recording.
    pub kind: &'static str,
    /// What it separates, and how.
    pub why: String,
}

/// The answer.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// What was found.
    pub outcome: Outcome,
    /// How well the case predicts.
    pub baseline: Quality,
    /// The causes, the surest first; where they are confounded, all of the set.
    pub causes: Vec<NamedCause>,
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
    /// What would tell more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_test: Option<NextTest>,
    /// What should be known about the records.
    pub warnings: Vec<String>,
    /// How many of `causes`, from the first, act together in the extended case.
    #[serde(skip)]
    pub acting: usize,
    /// The residuals, channel by channel.
    #[serde(skip)]
    pub views: Vec<View>,
}

impl Diagnosis {
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
