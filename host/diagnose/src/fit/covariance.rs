//! The covariance of the parameters of a candidate model that was fitted by linear regression.

use nalgebra::DMatrix;

use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::regression::{Regression, Subset};
use crate::records::domain::Domain;
use crate::records::study::Study;

/// For each cause of the candidate model: covariance of its coefficients and, after them, of its nonlinear parameters
/// (none if [`Library::slopes_of`] gives no derivatives for them), for unit-variance noise.
///
/// If all records are compared in force, the residual contains errors of the equations and of the differentiated motion
/// besides noise. The covariance is then estimated from the residual and divided by `inflation`, because the caller
/// multiplies it by that factor.
pub(crate) fn covariance(
    study: &Study<'_>,
    library: &Library,
    regression: &mut Regression,
    model: &CandidateModel,
    inflation: f64,
) -> Vec<DMatrix<f64>> {
    let mut columns = library.columns_of(model);
    let mut places: Vec<Vec<usize>> = Vec::new();
    let mut from = 0;
    for place in 0..model.choices.len() {
        let coefficients = library.coefficients(model, place);
        places.push((from..from + coefficients.len()).collect());
        from += coefficients.len();
    }
    for (rows, slopes) in places.iter_mut().zip(library.slopes_of(study, regression, model)) {
        rows.extend(columns.len()..columns.len() + slopes.len());
        columns.extend(slopes);
    }
    let whole = match regression.fit(Subset::Whole, &columns) {
        Some(fit) if study.all_in(Domain::Force) => {
            regression.covariance_by_residual(Subset::Whole, &columns, &fit) / inflation
        }
        Some(fit) => fit.covariance,
        None => model.fit.covariance.clone(),
    };
    places
        .iter()
        .map(|rows| {
            DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
                whole.get((rows[i], rows[j])).copied().unwrap_or(0.0)
            })
        })
        .collect()
}
