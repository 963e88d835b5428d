//! The methods that `--method` knows, and their options.

use std::path::{Path, PathBuf};

use super::{Error, non_negative};
use crate::case::Case;
use crate::frf::{FrfTable, Interpolation};
use crate::orbit::collocation_of;
use crate::stability::{
    Collocation, CubicTerms, Fdm, FrequencyProblem, FullDiscretization, Method, ModeCoupling, MultiFrequency,
    Nyquist, Pitched, Problem, RevolutionCollocation, Sdm, SdmOrder, SemiDiscretization, Zoa, after,
    needs_orbit,
};

/// Steps per tooth period where none are asked for.
const STEPS: usize = 100;

/// The most steps per tooth period: a step of a thousandth of a degree is finer than any table of coefficients.
const STEPS_MAX: usize = 20_000;

/// The most harmonics: beyond them the matrices are too large to be of use.
const HARMONICS_MAX: usize = 400;

/// Error of a table between its lines, as a share of its peak, from which on the user is told.
const COARSE: f64 = 0.01;

/// How to compute.
#[derive(Debug, clap::Args)]
pub(super) struct MethodChoice {
    /// How to compute; where nothing is said collocation, and with --frf multi-frequency.
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// Frequency response functions in place of the structure of the case: frequency_hz,hxx_re [m/N],hxx_im [m/N],…
    #[arg(long, value_name = "FILE")]
    frf: Option<PathBuf>,
    /// Harmonics of multi-frequency, else as many as limits need; of nyquist, else 0: averaged coefficients.
    #[arg(long, value_name = "N", value_parser = harmonics)]
    harmonics: Option<usize>,
    /// Leave out the cubic terms of a structure: the limits for vanishing feed.
    #[arg(long)]
    linear: bool,
    /// How long the machine has worked, in s: where the case has drift or wear, the limits hold for that moment. Between two
    /// moments they lie between those of both.
    #[arg(long, value_name = "T", value_parser = non_negative, allow_negative_numbers = true)]
    after_s: Option<f64>,
    /// Steps per tooth period of sdm and fdm; 100 where nothing is said.
    #[arg(long, value_name = "N", value_parser = steps)]
    steps: Option<usize>,
    /// Order of sdm: what stands for the delayed displacement within a step, a constant (0) or a straight line (1).
    #[arg(long, value_name = "0|1", value_parser = order)]
    order: Option<SdmOrder>,
}

/// The methods that can be asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum MethodName {
    /// Collocation of the one-period map; with variable pitch over the revolution, with cubic terms about the forced
    /// orbit.
    #[default]
    Collocation,
    /// Semi-discretization with a fixed number of steps.
    Sdm,
    /// Full discretization of first order with a fixed number of steps.
    Fdm,
    /// Zeroth-order approximation: averaged coefficients in closed form, blind to flips.
    Zoa,
    /// Nyquist criterion on the receptances: averaged coefficients, or periodic ones with --harmonics.
    Nyquist,
    /// Multi-frequency solution: the harmonics of the coefficients, flips included.
    MultiFrequency,
    /// Mode-coupling criterion, for comparison: no regeneration.
    ModeCoupling,
}

impl MethodChoice {
    /// The method on a case.
    ///
    /// # Errors
    /// The method is not defined for the case, or an option is not one of the method.
    pub(super) fn on(&self, case: &Case) -> Result<Box<dyn Method>, Error> {
        self.check_options()?;
        let moved;
        let case = match self.after_s {
            Some(after_s) => {
                moved = after(case, after_s)?;
                &moved
            }
            None => case,
        };
        if let Some(path) = &self.frf {
            let table = FrfTable::read(path).map_err(Error::input)?;
            tell_what_is_missing(&table)?;
            return self.by_receptances(FrequencyProblem::of_table(case, &table)?, path);
        }
        let about_orbit = needs_orbit(case) && !self.linear;
        // All but the default know limits for vanishing feed only: they refuse cubic terms unless these are left out.
        let cubic = if self.linear {
            CubicTerms::LeaveOut
        } else {
            CubicTerms::Refuse
        };
        let steps = self.steps.unwrap_or(STEPS);
        Ok(match self.name() {
            MethodName::Collocation if about_orbit => collocation_of(case)?,
            MethodName::Collocation if case.tool().map_err(Error::input)?.has_variable_pitch() => {
                Box::new(RevolutionCollocation {
                    pitched: Pitched::new(case, cubic)?,
                })
            }
            MethodName::Collocation => Box::new(Collocation {
                problem: Problem::new(case, cubic)?,
            }),
            MethodName::Sdm => Box::new(Sdm {
                pitched: Pitched::new(case, cubic)?,
                discretization: SemiDiscretization(self.order.unwrap_or_default()),
                steps,
            }),
            MethodName::Fdm => Box::new(Fdm {
                pitched: Pitched::new(case, cubic)?,
                discretization: FullDiscretization,
                steps,
            }),
            _ => return self.by_receptances(FrequencyProblem::new(case, cubic)?, &case.path),
        })
    }

    fn name(&self) -> MethodName {
        self.method.unwrap_or(if self.frf.is_some() {
            MethodName::MultiFrequency
        } else {
            MethodName::default()
        })
    }

    /// The methods that need no more than receptances; `path` is where these came from.
    fn by_receptances(&self, problem: FrequencyProblem, path: &Path) -> Result<Box<dyn Method>, Error> {
        Ok(match self.name() {
            MethodName::Zoa => Box::new(Zoa { problem }),
            MethodName::Nyquist => Box::new(Nyquist {
                problem,
                harmonics: self.harmonics.unwrap_or(0),
            }),
            MethodName::MultiFrequency => Box::new(MultiFrequency {
                problem,
                harmonics: self.harmonics,
            }),
            MethodName::ModeCoupling => Box::new(ModeCoupling::new(problem)?),
            MethodName::Collocation | MethodName::Sdm | MethodName::Fdm => {
                return Err(Error::input(format!(
                    "{}: this method needs a structure, of which frequency response functions are no more than \
                     lines; with --frf the methods are zoa, nyquist, multi-frequency and mode-coupling",
                    path.display()
                )));
            }
        })
    }

    fn check_options(&self) -> Result<(), Error> {
        let name = self.name();
        let in_steps = matches!(name, MethodName::Sdm | MethodName::Fdm);
        if self.steps.is_some() && !in_steps {
            return Err(Error::input(
                "--steps is an option of --method sdm and fdm; others choose steps of their own",
            ));
        }
        if self.order.is_some() && name != MethodName::Sdm {
            return Err(Error::input("--order is an option of --method sdm"));
        }
        if self.harmonics.is_some() && !matches!(name, MethodName::Nyquist | MethodName::MultiFrequency) {
            return Err(Error::input(
                "--harmonics is an option of --method nyquist and multi-frequency",
            ));
        }
        if self.harmonics == Some(0) && name == MethodName::MultiFrequency {
            return Err(Error::input(
                "--harmonics 0 leaves averaged coefficients, which --method zoa and nyquist are for; \
                 multi-frequency needs 1 or more",
            ));
        }
        Ok(())
    }
}

/// Says on stderr which receptances are taken for zero, and where a table is too coarse.
fn tell_what_is_missing(table: &FrfTable) -> Result<(), Error> {
    let file = table.path().display();
    let missing = table.missing();
    if !missing.is_empty() {
        let names: Vec<String> = missing.iter().map(|name| format!("h{name}")).collect();
        tracing::warn!("{file}: {} not there, taken for zero", names.join(", "));
    }
    for entry in table
        .entries()
        .iter()
        .filter(|entry| entry.response == entry.force)
    {
        // At rest a structure gives way to a force: with a mode below the first line it seems not to.
        if let (Some(first), Some(hz)) = (entry.receptance.first(), table.frequency_hz().first())
            && first.im.abs() > first.re
        {
            tracing::warn!(
                "{file}: h{} at its first line, {hz} Hz, is {:.2e}{:+.2e}i m/N, not that of a stiffness: a mode may lie \
                 below the table",
                entry.name(),
                first.re,
                first.im,
            );
        }
    }
    let error = Interpolation::new(table).map_err(Error::input)?.error();
    if error > COARSE {
        tracing::warn!(
            "{file}: between its lines the table is known to {:.1} % of its peak only; lines closer together would help",
            100.0 * error
        );
    }
    Ok(())
}

fn harmonics(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(harmonics) if harmonics <= HARMONICS_MAX => Ok(harmonics),
        _ => Err(format!(
            "`{text}` is not possible: it must be a whole number from 0 to {HARMONICS_MAX}"
        )),
    }
}

fn steps(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(steps) if (1..=STEPS_MAX).contains(&steps) => Ok(steps),
        _ => Err(format!(
            "`{text}` is not possible: it must be a whole number from 1 to {STEPS_MAX}"
        )),
    }
}

fn order(text: &str) -> Result<SdmOrder, String> {
    match text {
        "0" => Ok(SdmOrder::Zeroth),
        "1" => Ok(SdmOrder::First),
        _ => Err(format!("`{text}` is not possible: it must be 0 or 1")),
    }
}
