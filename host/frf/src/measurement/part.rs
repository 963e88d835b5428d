//! Recordings that are evaluated together.

use num_complex::Complex64;

use crate::driven::Driven;
use crate::estimate::Line;
use crate::excitation::Excitation;
use crate::hammer::Blow;
use crate::table::Frf;
use quietcut_model::structure::Direction;

/// Recordings that were evaluated together.
#[derive(Clone, Debug)]
pub struct Part {
    /// Number of recordings.
    pub recordings: usize,
    /// Directions of the forces.
    pub forces: Vec<Direction>,
    /// How they drove.
    pub excitation: Excitation,
    /// Independent averages.
    pub averages: f64,
    /// Frequencies at which forces were not independent, which are left out.
    pub left_out_hz: Vec<f64>,
    /// Smallest of the singular values of the forces over all frequencies that are left, each force divided by its
    /// root mean square; 1 for one force.
    pub least_singular: f64,
    /// The blows that were used, and those that were double.
    pub blows: Option<(Vec<Blow>, Vec<Blow>)>,
}

/// One part at its frequencies: a column for each response and force.
pub(super) struct Measured {
    pub(super) part: Part,
    pub(super) frequency_hz: Vec<f64>,
    pub(super) entries: Vec<(Frf, Vec<f64>)>,
    pub(super) warnings: Vec<String>,
}

/// Columns in m/N.
pub(super) fn receptances(
    part: Part,
    lines: &[Line],
    driven: &Driven<'_>,
    mut warnings: Vec<String>,
) -> Measured {
    let frequency_hz: Vec<f64> = lines.iter().map(|line| line.frequency_hz).collect();
    if !part.left_out_hz.is_empty() {
        warnings.push(format!(
            "the forces are not independent at {} frequencies, which are left out (the first is {:.3} Hz)",
            part.left_out_hz.len(),
            part.left_out_hz[0]
        ));
    }
    let mut entries = Vec::new();
    for (p, response) in driven.responses.iter().enumerate() {
        for (q, &force) in part.forces.iter().enumerate() {
            let integrated = |line: &Line| {
                Complex64::new(0.0, std::f64::consts::TAU * line.frequency_hz).powi(-response.derivatives)
            };
            let entry = Frf {
                response: response.direction,
                force,
                receptance: lines.iter().map(|line| line.h[p][q] * integrated(line)).collect(),
                coherence: Some(lines.iter().map(|line| line.coherence[p]).collect()),
            };
            let deviation = lines
                .iter()
                .map(|line| line.deviation[p][q] * integrated(line).norm())
                .collect();
            entries.push((entry, deviation));
        }
    }
    Measured {
        part,
        frequency_hz,
        entries,
        warnings,
    }
}
