//! What the records say of the parameters of the baseline that its case states as uncertain.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::conclusion::answer::NINETY_PERCENT;
use quietcut_model::case::{Case, Deviation, Parameter};
use quietcut_stability::Variable;

/// A parameter of the baseline that the records move away from the value of the case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaselineUpdate {
    /// Name of the parameter, as in `[uncertainty]`: `structure.mode.2.frequency_hz`.
    pub parameter: String,
    /// Value of the case, in the unit of the parameter.
    pub case: f64,
    /// Standard deviation that the case states, in the same unit.
    pub std: f64,
    /// Value that the records and the case give together, in the same unit.
    pub value: f64,
    /// Ends of its 90 % interval, in the same unit.
    pub ci90: [f64; 2],
}

impl BaselineUpdate {
    /// The update in words: `structure.mode.2.frequency_hz: 3.10 ± 0.12 % below the case, within its 5.0 %`. The intervals
    /// are those of 90 %, that of the case included.
    pub fn sentence(&self) -> String {
        let half = 0.5 * (self.ci90[1] - self.ci90[0]);
        let change = self.value - self.case;
        let allowed = NINETY_PERCENT * self.std;
        let side = if change < 0.0 { "below" } else { "above" };
        let within = if change.abs() <= allowed {
            "within"
        } else {
            "beyond"
        };
        // A share of a value that is small beside its uncertainty says nothing.
        if self.case.abs() > self.std {
            let percent = |part: f64| 100.0 * part / self.case.abs();
            let decimals = decimals(percent(half));
            format!(
                "{}: {:.decimals$} ± {:.decimals$} % {side} the case, {within} its {:.1} %",
                self.parameter,
                percent(change.abs()),
                percent(half),
                percent(allowed)
            )
        } else {
            format!(
                "{}: {:.4e} ± {half:.1e} in place of {:.4e}, {within} its {allowed:.1e}",
                self.parameter, self.value, self.case
            )
        }
    }
}

/// Decimals that show the first two digits of `value`, at most eight.
fn decimals(value: f64) -> usize {
    let first = value.max(f64::MIN_POSITIVE).log10().floor();
    (1.0 - first).clamp(0.0, 8.0) as usize
}

/// Uncertain parameters of a case before and after the records.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    parameters: Vec<Parameter>,
    /// Values and standard deviations of the case.
    case: DVector<f64>,
    std: DVector<f64>,
    /// Changes of the values, and their covariance.
    change: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Posterior {
    /// The parameters p = p₀ + A·z of `case` with the independent variables z, standard normal before the records, and `z`
    /// with `covariance` after them. `None` if no variable is given, or a parameter is not in the case.
    pub(crate) fn new(
        case: &Case,
        variables: &[Variable],
        z: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Option<Self> {
        let mut parameters: Vec<Parameter> = Vec::new();
        for part in variables.iter().flat_map(Variable::parts) {
            if !parameters.contains(&part.parameter) {
                parameters.push(part.parameter);
            }
        }
        if parameters.is_empty() {
            return None;
        }
        let part_of = |parameter: Parameter, variable: &Variable| -> f64 {
            let own = |part: &&Deviation| part.parameter == parameter;
            variable.parts().iter().filter(own).map(|part| part.std).sum()
        };
        let by_variable = DMatrix::from_fn(parameters.len(), variables.len(), |row, column| {
            part_of(parameters[row], &variables[column])
        });
        let values: Option<Vec<f64>> = parameters.iter().map(|parameter| parameter.value(case)).collect();
        Some(Self {
            case: DVector::from_vec(values?),
            std: DVector::from_iterator(parameters.len(), by_variable.row_iter().map(|row| row.norm())),
            change: &by_variable * z,
            covariance: &by_variable * covariance * by_variable.transpose(),
            parameters,
        })
    }

    /// The parameters whose 90 % interval excludes the value of the case.
    pub fn updates(&self) -> Vec<BaselineUpdate> {
        (0..self.parameters.len())
            .filter_map(|index| {
                let half = NINETY_PERCENT * self.covariance[(index, index)].max(0.0).sqrt();
                let value = self.case[index] + self.change[index];
                (self.change[index].abs() > half).then(|| BaselineUpdate {
                    parameter: self.parameters[index].name(),
                    case: self.case[index],
                    std: self.std[index],
                    value,
                    ci90: [value - half, value + half],
                })
            })
            .collect()
    }

    /// The uncertain parameters.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Their values after the records, in their units.
    pub fn values(&self) -> DVector<f64> {
        &self.case + &self.change
    }

    /// The covariance of these values.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// Gives `case` the values after the records. False if a value is not valid.
    pub(crate) fn shift(&self, case: &mut Case) -> bool {
        self.parameters
            .iter()
            .zip(self.change.iter())
            .all(|(parameter, by)| parameter.shift(case, *by))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const CASE: &str = r#"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[100.0, 0.0], [0.0, 120.0]]
damping = [[300.0, 0.0], [0.0, 310.0]]
stiffness = [[2e6, 1e5], [1e5, 3e6]]
stiffness_std = [[4e4, 1e4], [1e4, 0.0]]
"#;

    #[test]
    fn mirrored_entries_move_together_and_only_what_moved_is_listed() {
        let case = Case::parse(Path::new("case.toml"), CASE).unwrap();
        let variables = Variable::of_case(&case);
        // k_xx two standard deviations up, and known to a tenth; k_xy as before.
        let z = DVector::from_vec(vec![2.0, 0.3]);
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![0.01, 0.9]));
        let posterior = Posterior::new(&case, &variables, &z, &covariance).unwrap();
        assert_eq!(posterior.parameters().len(), 3);
        let updates = posterior.updates();
        assert_eq!(updates.len(), 1, "{updates:?}");
        assert_eq!(updates[0].parameter, "structure.stiffness.1.1");
        assert_eq!(
            [updates[0].case, updates[0].std, updates[0].value],
            [2e6, 4e4, 2.08e6]
        );
        assert!((updates[0].ci90[0] - (2.08e6 - NINETY_PERCENT * 4e3)).abs() < 1e-6);
        assert_eq!(
            updates[0].sentence(),
            "structure.stiffness.1.1: 4.00 ± 0.33 % above the case, beyond its 3.3 %"
        );
        let mut moved = case.clone();
        assert!(posterior.shift(&mut moved));
        let entry = |i, j| Parameter::Stiffness(i, j).value(&moved).unwrap();
        assert_eq!([entry(0, 0), entry(0, 1), entry(1, 0)], [2.08e6, 1.03e5, 1.03e5]);
        assert!((posterior.covariance()[(1, 2)] - 0.9e8).abs() < 1.0);
    }
}
