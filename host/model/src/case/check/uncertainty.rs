//! Reads the joint covariance of parameters from the case file.

use nalgebra::DMatrix;
use quietcut_numerics::eigenvalues::of_symmetric;
use toml::Spanned;

use super::Check;
use crate::case::file::UncertaintyFile;
use crate::case::{Case, CaseError, Parameter, ParameterCovariance};
use crate::criteria::COVARIANCE_ROUNDING;
use crate::effects::nearest::nearest;

const PARAMETERS: &str = "uncertainty.parameters";
const COVARIANCE: &str = "uncertainty.covariance";

impl Check<'_> {
    /// The section `[uncertainty]` of a case whose other sections are already read.
    pub(super) fn uncertainty(
        &self,
        file: &UncertaintyFile,
        case: &Case,
    ) -> Result<ParameterCovariance, CaseError> {
        let parameters = self.uncertain_parameters(&file.parameters, case)?;
        let covariance = self.rows_of_covariance(&file.covariance, &parameters)?;
        for (i, row) in file.covariance.get_ref().iter().enumerate() {
            let variance = covariance[(i, i)];
            if variance < 0.0 {
                let found = format!("{variance} in row {}, column {}", i + 1, i + 1);
                return Err(self.wrong(row, COVARIANCE, found, "a variance of 0 or more on the diagonal"));
            }
        }
        for (i, row) in file.covariance.get_ref().iter().enumerate() {
            for j in 0..parameters.len() {
                self.pair_of_covariance(row, &covariance, (i, j), &parameters)?;
            }
        }
        let known = ParameterCovariance {
            parameters,
            covariance,
        };
        let lowest = of_symmetric(known.correlation()).map(|eigen| eigen.eigenvalues.min());
        let size = known.parameters.len() as f64;
        if !lowest.is_ok_and(|lowest| lowest >= -size * COVARIANCE_ROUNDING) {
            let found = "correlations that exclude each other (a negative eigenvalue)";
            let expected =
                "a positive semidefinite matrix, with no combination of the parameters of negative variance,";
            return Err(self.wrong(&file.covariance, COVARIANCE, found, expected));
        }
        Ok(known)
    }

    fn uncertain_parameters(
        &self,
        names: &Spanned<Vec<Spanned<String>>>,
        case: &Case,
    ) -> Result<Vec<Parameter>, CaseError> {
        let all = Parameter::of_case(case);
        let known: Vec<String> = all.iter().map(|parameter| parameter.name()).collect();
        let mut parameters = Vec::new();
        for spanned in names.get_ref() {
            let name = spanned.get_ref();
            let Some(at) = known.iter().position(|known| known == name) else {
                let expected = match nearest(name, known.iter().map(String::as_str)) {
                    Some(closest) => format!("\"{closest}\" (the closest)"),
                    None => "a parameter that this case has, such as \"structure.mode.1.frequency_hz\" or \"material.ktc_mpa\",".into(),
                };
                return Err(self.wrong(spanned, PARAMETERS, format!("\"{name}\""), expected));
            };
            if parameters.contains(&all[at]) {
                return Err(self.wrong(
                    spanned,
                    PARAMETERS,
                    format!("\"{name}\" twice"),
                    "each parameter once",
                ));
            }
            if case
                .deviations
                .iter()
                .any(|deviation| deviation.parameter == all[at])
            {
                let found = format!("\"{name}\", which also has a standard deviation in its section");
                return Err(self.wrong(
                    spanned,
                    PARAMETERS,
                    found,
                    "either a row here or the key that ends in _std",
                ));
            }
            parameters.push(all[at]);
        }
        if parameters.is_empty() {
            return Err(self.wrong(names, PARAMETERS, "an empty list", "at least one parameter"));
        }
        Ok(parameters)
    }

    fn rows_of_covariance(
        &self,
        rows: &Spanned<Vec<Spanned<Vec<f64>>>>,
        parameters: &[Parameter],
    ) -> Result<DMatrix<f64>, CaseError> {
        let size = parameters.len();
        let expected = || format!("{size} rows of {size} numbers, one for each of the parameters");
        let lines = rows.get_ref();
        if lines.len() != size {
            return Err(self.wrong(rows, COVARIANCE, format!("{} rows", lines.len()), expected()));
        }
        for (i, line) in lines.iter().enumerate() {
            let entries = line.get_ref();
            if entries.len() != size {
                let found = format!("{} entries in row {}", entries.len(), i + 1);
                return Err(self.wrong(line, COVARIANCE, found, expected()));
            }
            if let Some(j) = entries.iter().position(|entry| !entry.is_finite()) {
                let found = format!("{} in row {}, column {}", entries[j], i + 1, j + 1);
                return Err(self.wrong(line, COVARIANCE, found, "a finite number"));
            }
        }
        let entries = lines.iter().flat_map(|line| line.get_ref().iter().copied());
        Ok(DMatrix::from_row_iterator(size, size, entries))
    }

    /// Checks that entries (i, j) and (j, i) are equal, and that the magnitude of entry (i, j) does not exceed the
    /// product of the standard deviations of both parameters; both up to [`COVARIANCE_ROUNDING`].
    fn pair_of_covariance(
        &self,
        row: &Spanned<Vec<f64>>,
        covariance: &DMatrix<f64>,
        (i, j): (usize, usize),
        parameters: &[Parameter],
    ) -> Result<(), CaseError> {
        let [one, mirrored] = [covariance[(i, j)], covariance[(j, i)]];
        let largest = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        let found = format!("{one} in row {}, column {}", i + 1, j + 1);
        if (one - mirrored).abs() > COVARIANCE_ROUNDING * largest {
            let expected = format!(
                "the same as in row {}, column {} ({mirrored}): a symmetric matrix",
                j + 1,
                i + 1
            );
            return Err(self.wrong(row, COVARIANCE, found, expected));
        }
        if one.abs() > (1.0 + COVARIANCE_ROUNDING) * largest {
            let expected = format!(
                "at most {largest} in magnitude, the product of the standard deviations of {} and {},",
                parameters[i].name(),
                parameters[j].name()
            );
            return Err(self.wrong(row, COVARIANCE, found, expected));
        }
        Ok(())
    }
}
