//! What `identify` answers.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Error;
use crate::identify::case_file::{self, Estimate};
use crate::identify::homogeneity::Region;
use crate::identify::linearity::Verdict;
use crate::identify::modes::{ChannelNoise, ModalModel, Rejected};
use crate::identify::ncma::Map;
use crate::identify::reciprocity::Reciprocity;
use crate::identify::student::NINETY_PERCENT;
use crate::identify::sweep::Comparison;
use crate::structure::Direction;

/// The answer of the verb.
#[derive(Debug, Default, Serialize)]
pub(super) struct Answer {
    pub(super) method: &'static str,
    /// Complex modes by rising frequency.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) complex_modes: Vec<ComplexMode>,
    /// Poles that are no modes, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) rejected: Vec<Rejected>,
    /// Median coherence of each response.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) coherence: BTreeMap<&'static str, f64>,
    /// Noise of the channels, where modes were fitted to the records themselves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) noise: Vec<ChannelNoise>,
    /// Parameters by the directions that they belong to.
    pub(super) models: Vec<Model>,
    /// Root mean square of what is left over that of the data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) fit_error: Option<f64>,
    /// Sum of squares over degrees of freedom in units of the noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) misfit: Option<f64>,
    /// Steady motions that were used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) dwells: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) linearity: Option<Linearity>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) maps: Option<Maps>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) slices: Option<Slices>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) cutting: Option<Cutting>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) modes: Option<Vec<OfMode>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) joints: Option<Vec<OfJoint>>,
    pub(super) warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) case: Option<PathBuf>,
    /// A case that is no equation of motion.
    #[serde(skip)]
    pub(super) table: Option<toml::Table>,
    /// Of complex modes: what becomes a case.
    #[serde(skip)]
    pub(super) modal: Option<ModalModel>,
    /// What becomes a case.
    #[serde(skip)]
    pub(super) estimates: Vec<Estimate>,
    #[serde(skip)]
    pub(super) directions: Vec<Direction>,
    /// Lines for people.
    #[serde(skip)]
    pub(super) said: Vec<String>,
}

/// Parameters of one direction, or of a pair.
#[derive(Debug, Serialize)]
pub(super) struct Model {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) direction: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) directions: Option<Vec<&'static str>>,
    pub(super) parameters: BTreeMap<&'static str, Figure>,
}

/// A value and its 90 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Figure {
    pub(super) value: f64,
    pub(super) ci90: [f64; 2],
}

/// A complex mode.
#[derive(Debug, Serialize)]
pub(super) struct ComplexMode {
    pub(super) frequency_hz: Figure,
    pub(super) damping_ratio: Figure,
    pub(super) left: BTreeMap<&'static str, Parts>,
    pub(super) right: BTreeMap<&'static str, Parts>,
}

/// Real and imaginary part of an entry of a shape.
#[derive(Debug, Serialize)]
pub(super) struct Parts {
    pub(super) re: Figure,
    pub(super) im: Figure,
}

/// What `--method linearity` finds.
#[derive(Debug, Default, Serialize)]
pub(super) struct Linearity {
    /// True where no check speaks against a linear structure.
    pub(super) linear: bool,
    /// Steady tones, by the direction of the force.
    pub(super) tones: Vec<OfTones>,
    /// Pairs of sweeps.
    pub(super) sweeps: Vec<OfSweeps>,
    pub(super) reciprocity: Vec<Reciprocity>,
}

#[derive(Debug, Serialize)]
pub(super) struct OfTones {
    pub(super) direction: &'static str,
    #[serde(flatten)]
    pub(super) verdict: Verdict,
    /// Of a tone with rising force: regions of X(F), and where it jumps, N.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) regions: Vec<Region>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) jumps_n: Vec<f64>,
}

/// Two sweeps that were compared.
#[derive(Debug, Serialize)]
pub(super) struct OfSweeps {
    pub(super) recordings: [PathBuf; 2],
    #[serde(flatten)]
    pub(super) comparison: Comparison,
}

/// Empirical maps: coefficients of a(F), b(F), c(F) in a·(X/F)² + b·(X/F) + c, each from the highest power of F down.
#[derive(Debug, Serialize)]
pub(super) struct Maps {
    pub(super) frequency_hz: Coefficients,
    pub(super) loss_factor: Coefficients,
}

#[derive(Debug, Serialize)]
pub(super) struct Coefficients {
    pub(super) coefficients: Vec<f64>,
    pub(super) ci90: Vec<[f64; 2]>,
    pub(super) fit_error: f64,
    pub(super) force_n: [f64; 2],
    pub(super) receptance_m_per_n: [f64; 2],
}

/// A mode that was found without a measured force.
#[derive(Debug, Serialize)]
pub(super) struct OfMode {
    pub(super) frequency_hz: Figure,
    pub(super) damping_ratio: Figure,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) stiffness_n_per_m: Option<Figure>,
    /// Quantities that the data leave as good as open.
    pub(super) cannot_tell: Vec<&'static str>,
}

/// What was identified of a joint and its link.
#[derive(Debug, Serialize)]
pub(super) struct OfJoint {
    /// From 1, from the base on.
    pub(super) joint: usize,
    pub(super) parameters: BTreeMap<&'static str, Figure>,
}

/// What cutting tests say besides the force coefficients.
#[derive(Debug, Serialize)]
pub(super) struct Cutting {
    /// Force coefficients by mean forces over the feed; `null` where all feeds are the same.
    pub(super) averaged: Option<BTreeMap<&'static str, Figure>>,
    /// How far each tooth stands out from the mean of all.
    pub(super) runout_um: Vec<Figure>,
    pub(super) revolutions: usize,
    pub(super) feeds: usize,
}

/// What the slices of the restoring-force surface give.
#[derive(Debug, Serialize)]
pub(super) struct Slices {
    pub(super) stiffness: BTreeMap<&'static str, Figure>,
    pub(super) damping: BTreeMap<&'static str, Figure>,
}

impl Figure {
    pub(super) fn new(value: f64, deviation: f64) -> Self {
        let half = NINETY_PERCENT * deviation;
        Self {
            value,
            ci90: [value - half, value + half],
        }
    }
}

impl Coefficients {
    pub(super) fn new(map: &Map) -> Self {
        Self {
            coefficients: map.coefficients.clone(),
            ci90: map
                .coefficients
                .iter()
                .zip(&map.deviations)
                .map(|(value, deviation)| Figure::new(*value, *deviation).ci90)
                .collect(),
            fit_error: map.relative_error,
            force_n: map.range[0],
            receptance_m_per_n: map.range[1],
        }
    }
}

impl Model {
    /// What the line of a parameter begins with.
    pub(super) fn place(&self) -> String {
        match (&self.direction, &self.directions) {
            (Some(direction), _) => format!("{direction} "),
            (None, Some(pair)) => format!("{} ", pair.join("-")),
            (None, None) => String::new(),
        }
    }
}

impl Answer {
    /// An answer whose parameters are `estimates`.
    pub(super) fn of(method: &'static str, directions: Vec<Direction>, estimates: Vec<Estimate>) -> Self {
        let mut models: Vec<Model> = Vec::new();
        for estimate in &estimates {
            let names: Vec<&'static str> = estimate
                .directions
                .iter()
                .map(|direction| direction.name())
                .collect();
            let (direction, pair) = match names[..] {
                [] => (None, None),
                [one] => (Some(one), None),
                _ => (None, Some(names)),
            };
            let index = models
                .iter()
                .position(|model| model.direction == direction && model.directions == pair)
                .unwrap_or_else(|| {
                    models.push(Model {
                        direction,
                        directions: pair,
                        parameters: BTreeMap::new(),
                    });
                    models.len() - 1
                });
            models[index]
                .parameters
                .insert(estimate.key, Figure::new(estimate.value, estimate.deviation));
        }
        Self {
            method,
            models,
            estimates,
            directions,
            ..Self::default()
        }
    }

    /// The case file of the model; `other` has the sections that are not the structure.
    pub(super) fn case(&self, path: &Path, other: Option<&toml::Table>) -> Result<String, Error> {
        let text = self.structure(path)?;
        Ok(match other {
            Some(other) => case_file::with_sections(&text, other),
            None => text,
        })
    }

    fn structure(&self, path: &Path) -> Result<String, Error> {
        let name = path
            .file_stem()
            .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let refused = |error| Error::input(format!("--out {}: {error}", path.display()));
        if let Some(table) = &self.table {
            // A table of numbers and words is always TOML.
            return Ok(toml::to_string(table).unwrap_or_default());
        }
        if let Some(model) = &self.modal {
            return case_file::text_of_modes(&name, model).map_err(refused);
        }
        if self.estimates.is_empty() {
            return Err(Error::input(format!(
                "--out {}: --method {} gives no equation of motion that a case could hold",
                path.display(),
                self.method
            )));
        }
        case_file::text(&name, &self.directions, &self.estimates).map_err(refused)
    }
}
