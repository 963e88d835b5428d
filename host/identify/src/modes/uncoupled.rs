//! Parts of a structure between which no receptance was measured, such as x and y of taps with one sensor that moves with the hammer.
//!
//! Each part is identified by itself. Together they are a model whose receptances between parts are zero by statement.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::mode::IdentifiedMode;
use super::model::ModalModel;
use super::receptances::Receptances;
use super::stabilization::Stabilization;
use quietcut_model::structure::{Direction, Mode};

/// The models of all parts as one, in the directions of `data`. Shapes are zero in the directions of other parts, and so is the covariance
/// between parts. The error of the fit is the root mean square over all receptances, and χ² per degree of freedom their mean, weighted with
/// the number of receptances.
pub(super) fn joined(data: &Receptances, parts: Vec<ModalModel>) -> ModalModel {
    let mut order: Vec<(usize, usize)> = Vec::new();
    for (part, model) in parts.iter().enumerate() {
        order.extend((0..model.modes.len()).map(|mode| (part, mode)));
    }
    let hertz = |&(part, mode): &(usize, usize)| parts[part].modes[mode].mode.frequency_hz;
    order.sort_by(|a, b| hertz(a).total_cmp(&hertz(b)));
    let modes = order
        .iter()
        .map(|&(part, mode)| in_directions(data, &parts[part], mode))
        .collect();
    let covariance = covariance(data, &parts, &order);
    let count = |model: &ModalModel| model.outside.len() as f64;
    let all: f64 = parts.iter().map(count).sum();
    let mean = |of: &dyn Fn(&ModalModel) -> Option<f64>| -> Option<f64> {
        let sum: Option<f64> = parts.iter().map(|model| Some(count(model) * of(model)?)).sum();
        sum.map(|sum| sum / all)
    };
    let fit_error = mean(&|model| Some(model.fit_error.powi(2)))
        .unwrap_or_default()
        .sqrt();
    let misfit = mean(&|model| model.misfit);
    let mut model = ModalModel {
        forces: data.forces.clone(),
        responses: data.responses.clone(),
        modes,
        covariance,
        gain_error: None,
        outside: Vec::new(),
        fit_error,
        misfit,
        stabilization: Stabilization::default(),
        rejected: Vec::new(),
        warnings: Vec::new(),
    };
    let mut diagrams = Vec::new();
    for part in parts {
        model.outside.extend(part.outside);
        model.rejected.extend(part.rejected);
        model.warnings.extend(part.warnings);
        diagrams.push(part.stabilization);
    }
    model.stabilization = Stabilization::together(diagrams);
    model
}

/// Index of each direction of a part among all directions.
fn indices(all: &[Direction], part: &[Direction]) -> Vec<usize> {
    part.iter()
        .filter_map(|direction| all.iter().position(|known| known == direction))
        .collect()
}

fn in_directions(data: &Receptances, part: &ModalModel, mode: usize) -> IdentifiedMode {
    let found = &part.modes[mode];
    let spread = |all: &[Direction], of: &[Direction], shape: &[Complex64], std: &[[f64; 2]]| {
        let (mut values, mut deviations) = (vec![Complex64::ZERO; all.len()], vec![[0.0; 2]; all.len()]);
        for (from, to) in indices(all, of).into_iter().enumerate() {
            (values[to], deviations[to]) = (shape[from], std[from]);
        }
        (values, deviations)
    };
    let (left, left_std) = spread(&data.forces, &part.forces, &found.mode.left, &found.left_std);
    let (right, right_std) = spread(
        &data.responses,
        &part.responses,
        &found.mode.right,
        &found.right_std,
    );
    IdentifiedMode {
        mode: Mode {
            left,
            right,
            ..found.mode
        },
        left_std,
        right_std,
        ..*found
    }
}

/// Covariance of all modes in the order `order` of (part, mode), as [`ModalModel::covariance`] has it.
fn covariance(data: &Receptances, parts: &[ModalModel], order: &[(usize, usize)]) -> DMatrix<f64> {
    let (lefts, rights) = (2 * data.forces.len(), 2 * data.responses.len());
    let width = 2 + lefts + rights;
    // For each part, the place of each of its parameters among all.
    let places: Vec<Vec<usize>> = parts
        .iter()
        .enumerate()
        .map(|(part, model)| {
            let pairs = |all: &[Direction], of: &[Direction], first: usize| -> Vec<usize> {
                let entries = indices(all, of).into_iter();
                entries
                    .flat_map(|entry| [first + 2 * entry, first + 2 * entry + 1])
                    .collect()
            };
            let mut within = vec![0, 1];
            within.extend(pairs(&data.forces, &model.forces, 2));
            within.extend(pairs(&data.responses, &model.responses, 2 + lefts));
            (0..model.modes.len())
                .flat_map(|mode| {
                    let at = order.iter().position(|&known| known == (part, mode));
                    let first = width * at.unwrap_or_default();
                    within.iter().map(move |place| first + place).collect::<Vec<_>>()
                })
                .collect()
        })
        .collect();
    let mut covariance = DMatrix::zeros(width * order.len(), width * order.len());
    for (model, places) in parts.iter().zip(&places) {
        for (i, &row) in places.iter().enumerate() {
            for (j, &column) in places.iter().enumerate() {
                covariance[(row, column)] = model.covariance[(i, j)];
            }
        }
    }
    covariance
}
