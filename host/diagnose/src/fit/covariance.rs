//! The covariance of the parameters of a candidate model that was fitted by linear regression.

use nalgebra::{DMatrix, DVector};

use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::regression::{Fit, Regression, Subset};
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

impl Regression {
    /// Covariance of the coefficients of a fit whose residual is not unit-variance noise, but an error of the equations
    /// with an unknown spectrum: (XᵀX)⁻¹ Xᵀ diag(r²/(1 − h)²) X (XᵀX)⁻¹ with the regression columns X, the residual r
    /// of the fit and h = diag(X (XᵀX)⁻¹ Xᵀ). The values of the spectrum are taken as independent of each other (HC3 of
    /// MacKinnon and White, 1985).
    pub(crate) fn covariance_by_residual(
        &self,
        subset: Subset,
        columns: &[usize],
        fit: &Fit,
    ) -> DMatrix<f64> {
        let mut middle = DMatrix::zeros(columns.len(), columns.len());
        let of_subset = self
            .segments
            .iter()
            .enumerate()
            .filter(|(_, segment)| segment.subset == subset);
        for (segment, _) in of_subset {
            let residual = &self.residuals[segment];
            let mut x = DMatrix::from_fn(residual.len(), columns.len(), |row, column| {
                self.columns[columns[column]][segment][row]
            });
            let left =
                DVector::from_column_slice(residual) - &x * DVector::from_column_slice(&fit.coefficients);
            let leverage = (&x * &fit.covariance).component_mul(&x).column_sum();
            for (mut row, (left, leverage)) in x.row_iter_mut().zip(left.iter().zip(leverage.iter())) {
                row *= left / (1.0 - leverage.min(1.0 - f64::EPSILON));
            }
            middle += x.tr_mul(&x);
        }
        &fit.covariance * middle * &fit.covariance
    }
}
