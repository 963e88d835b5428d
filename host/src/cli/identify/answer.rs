//! Output of `quietcut identify`: parameters with 90 % intervals, as JSON, as text and as a case file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Error;
use super::backbone_answer::Backbone;
use super::figure::Figure;
use super::mode_shapes_answer::ModeShapes;
use super::modes_comparison::ModesComparison;
use crate::identify::case_file::{self, Estimate};
use crate::identify::homogeneity::Region;
use crate::identify::linearity::Verdict;
use crate::identify::modes::{ChannelNoise, ModalModel, Rejected};
use crate::identify::ncma::Map;
use crate::identify::reciprocity::Reciprocity;
use crate::identify::sweep::Comparison;
use crate::structure::Direction;

/// Output of `quietcut identify` for any method; a field that the method does not compute stays empty.
#[derive(Debug, Default, Serialize)]
pub(super) struct IdentifyOutput {
    pub(super) method: &'static str,
    /// Complex modes that `--method modes` identified, in ascending order of natural frequency.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) complex_modes: Vec<ComplexMode>,
    /// Modal assurance criterion between the shapes of the complex modes, by rows; missing with one direction, where it is 1 by construction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mac: Option<Vec<Vec<f64>>>,
    /// Comparison of the complex modes with those of the case or test of `--compare`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) comparison: Option<ModesComparison>,
    /// Poles of the fitted receptance matrix that were rejected as structural modes, with the reason.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) rejected: Vec<Rejected>,
    /// By direction of the response: median of its coherence over the identified frequency band. A response without
    /// coherence is missing.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) coherence: BTreeMap<&'static str, f64>,
    /// Estimated noise of each force and response channel of each recording; empty unless the modes were fitted to the
    /// spectra of whole recordings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) noise: Vec<ChannelNoise>,
    /// Identified parameters, grouped by direction or pair of directions; cutting coefficients have no direction.
    pub(super) models: Vec<Model>,
    /// Root mean square of the residual divided by that of the data; the method determines which data. `None` for a
    /// method that does not state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) fit_error: Option<f64>,
    /// Reduced χ² of the identified model: weighted sum of squared residuals divided by (number of residuals − number
    /// of parameters). `None` for a method that does not compute it, and for receptances of unknown variance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) misfit: Option<f64>,
    /// Number of steady sine responses (dwells) taken from the recordings; for `linearity` plus the windows of sines
    /// with increasing force. `None` for a method that does not state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) dwells: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) linearity: Option<Linearity>,
    /// Frequency and damping over the amplitude, of `--method backbone`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) backbone: Option<Backbone>,
    /// Modes with shapes over points, of `--method mode-shapes`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mode_shapes: Option<ModeShapes>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) maps: Option<Maps>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) slices: Option<Slices>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) cutting: Option<Cutting>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) modes: Option<Vec<EstimatedMode>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) joints: Option<Vec<EstimatedJoint>>,
    /// Spindle speed at which the structure was measured, rev/min, 0 at standstill; missing if neither `--rpm` nor the recordings state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) structure_rpm: Option<f64>,
    pub(super) warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) case: Option<PathBuf>,
    /// All files that were written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) out: Vec<PathBuf>,
    /// Content of the case file that `joints` (robot joints), `inverse-stability` (modes) or `force-coefficients`
    /// (cutting) writes; `None` for the other methods, and for `force-coefficients` without a measured axial force.
    #[serde(skip)]
    pub(super) table: Option<toml::Table>,
    /// Modal model of the structure that `--method modes` writes into the case file; `None` for the other methods.
    #[serde(skip)]
    pub(super) modal: Option<ModalModel>,
    /// Estimated parameters of the equation of motion or of the cutting force; the case file contains them if `table`
    /// and `modal` are `None`.
    #[serde(skip)]
    pub(super) estimates: Vec<Estimate>,
    #[serde(skip)]
    pub(super) directions: Vec<Direction>,
    /// Picture of the result as SVG, and its caption; `None` for a method without one, and if no file shows it.
    #[serde(skip)]
    pub(super) picture: Option<(String, &'static str)>,
    /// Lines of the text output after those of `models`.
    #[serde(skip)]
    pub(super) messages: Vec<String>,
}

/// Identified parameters of one direction of the structure, of a pair of directions, or, without a direction, of the
/// cutting force.
#[derive(Debug, Serialize)]
pub(super) struct Model {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) direction: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) directions: Option<Vec<&'static str>>,
    pub(super) parameters: BTreeMap<&'static str, Figure>,
}

/// Identified complex mode with its left and right mode shapes (eq. 7.15 of the thesis that the example data come
/// from).
#[derive(Debug, Serialize)]
pub(super) struct ComplexMode {
    pub(super) frequency_hz: Figure,
    pub(super) damping_ratio: Figure,
    pub(super) left: BTreeMap<&'static str, ComplexFigure>,
    pub(super) right: BTreeMap<&'static str, ComplexFigure>,
    /// Modal mass, damping and stiffness; missing without a direction that is both driven and measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) modal: Option<Modal>,
}

/// Modal mass, damping and stiffness of a mode at its drive point.
#[derive(Debug, Serialize)]
pub(super) struct Modal {
    /// Direction of the drive point.
    pub(super) direction: &'static str,
    pub(super) mass_kg: Figure,
    pub(super) damping_ns_per_m: Figure,
    pub(super) stiffness_n_per_m: Figure,
    /// Angle of the residue from that of a real mode, degrees.
    pub(super) phase_deg: f64,
}

/// Real and imaginary part of one component of a complex mode shape, each with its 90 % interval.
#[derive(Debug, Serialize)]
pub(super) struct ComplexFigure {
    pub(super) re: Figure,
    pub(super) im: Figure,
}

/// Results of `--method linearity`.
#[derive(Debug, Default, Serialize)]
pub(super) struct Linearity {
    /// Whether all linearity checks agree with a linear structure.
    pub(super) linear: bool,
    /// Linearity checks of steady sine responses and of sines with increasing force: one entry for each direction of
    /// the force in which a frequency was measured at two levels.
    pub(super) tones: Vec<TonesLinearity>,
    /// Comparisons of two sine sweeps.
    pub(super) sweeps: Vec<SweepPair>,
    pub(super) reciprocity: Vec<Reciprocity>,
}

#[derive(Debug, Serialize)]
pub(super) struct TonesLinearity {
    pub(super) direction: &'static str,
    #[serde(flatten)]
    pub(super) verdict: Verdict,
    /// Ranges of the force amplitude F in which the amplitude X of the recorded motion along the force is a linear
    /// function of F, from sines of constant frequency and increasing force.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) regions: Vec<Region>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) jumps_n: Vec<f64>,
}

/// Comparison of two sine sweeps with the same direction of the force and the same quantity of the motion.
#[derive(Debug, Serialize)]
pub(super) struct SweepPair {
    pub(super) recordings: [PathBuf; 2],
    #[serde(flatten)]
    pub(super) comparison: Comparison,
}

/// Empirical maps of natural frequency and loss factor of a nonlinear complex mode over force F and receptance X/F:
/// coefficients of a(F), b(F), c(F) in a·(X/F)² + b·(X/F) + c, each in descending powers of F.
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

/// Vibration mode that was identified without a measured force.
#[derive(Debug, Serialize)]
pub(super) struct EstimatedMode {
    pub(super) frequency_hz: Figure,
    pub(super) damping_ratio: Figure,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) stiffness_n_per_m: Option<Figure>,
    /// Keys of the parameters of the mode (frequency, damping ratio, stiffness) that the data do not identify.
    pub(super) cannot_tell: Vec<&'static str>,
}

/// Identified parameters of a robot joint and its link.
#[derive(Debug, Serialize)]
pub(super) struct EstimatedJoint {
    /// Number of the robot joint, counted from 1 at the base.
    pub(super) joint: usize,
    pub(super) parameters: BTreeMap<&'static str, Figure>,
}

/// Results of cutting tests besides the fitted force coefficients: coefficients from mean forces, and runout.
#[derive(Debug, Serialize)]
pub(super) struct Cutting {
    /// Force coefficients from the regression of mean forces on the feed (Altintas); `null` if `feeds` is 1, or if mean
    /// forces do not determine the coefficients.
    pub(super) averaged: Option<BTreeMap<&'static str, Figure>>,
    /// Radial runout of each tooth relative to the mean of all teeth, µm.
    pub(super) runout_um: Vec<Figure>,
    pub(super) revolutions: usize,
    pub(super) feeds: usize,
}

/// Linear and cubic stiffness of the structure from the slice of the restoring-force surface near zero velocity, and
/// linear and cubic damping from the slice near zero displacement.
#[derive(Debug, Serialize)]
pub(super) struct Slices {
    pub(super) stiffness: BTreeMap<&'static str, Figure>,
    pub(super) damping: BTreeMap<&'static str, Figure>,
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
    /// Text before each parameter of the model in the text output: the direction, or the pair of directions; empty
    /// without a direction.
    pub(super) fn label(&self) -> String {
        match (&self.direction, &self.directions) {
            (Some(direction), _) => format!("{direction} "),
            (None, Some(pair)) => format!("{} ", pair.join("-")),
            (None, None) => String::new(),
        }
    }
}

impl IdentifyOutput {
    /// Output of identification method `method` with the estimated parameters `estimates`.
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

    /// Table of a method with one, as CSV.
    pub(super) fn csv(&self) -> Option<String> {
        let of_shapes = || self.mode_shapes.as_ref().map(ModeShapes::csv);
        self.backbone.as_ref().map(Backbone::csv).or_else(of_shapes)
    }

    /// TOML text of the case file with the identified model. A case `other` is combined with identified cutting
    /// coefficients as by [`case_file::with_coefficients`], with another model as by [`case_file::with_sections`].
    pub(super) fn case(&self, path: &Path, other: Option<&toml::Table>) -> Result<String, Error> {
        if let (Some(_), Some(table), Some(other)) = (&self.cutting, &self.table, other) {
            return toml::to_string(&case_file::with_coefficients(table, other))
                .map_err(|error| Error::other(format!("--out {}: {error}", path.display())));
        }
        let refused = |error| Error::input(format!("--out {}: {error}", path.display()));
        let mut text = self.structure(path)?;
        if let Some(rpm) = self.structure_rpm {
            text = case_file::with_speed(&text, rpm).map_err(refused)?;
        }
        match other {
            Some(other) => case_file::with_sections(&text, other).map_err(refused),
            None => Ok(text),
        }
    }

    fn structure(&self, path: &Path) -> Result<String, Error> {
        let name = path
            .file_stem()
            .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let refused = |error| Error::input(format!("--out {}: {error}", path.display()));
        if let Some(table) = &self.table {
            return toml::to_string(table)
                .map_err(|error| Error::other(format!("--out {}: {error}", path.display())));
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
