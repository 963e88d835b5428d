//! Stability methods of `--method` and their options.

use std::path::{Path, PathBuf};

use quietcut_model::effects::EffectName;

use super::{Error, non_negative, progress};
use crate::case::Case;
use crate::criteria::{COARSE_TABLE, SMALL_FOLDING};
use crate::frf::{Frf, FrfTable, ImportedTable, Interpolation, table_doubts};
use crate::orbit::collocation_of;
use crate::recording::{ColumnMap, ColumnMaps, Import};
use crate::report::digits::significant;
use crate::stability::{
    Collocation, CubicTerms, Fdm, FrequencyProblem, FullDiscretization, Method, ModeCoupling, MultiFrequency,
    Nyquist, Pitched, Problem, RevolutionCollocation, Sdm, SdmOrder, SemiDiscretization, Zoa, after,
    depends_on_speed, needs_orbit,
};

/// Default number of time steps per tooth-passing period of semi-discretization and full discretization: a choice.
const STEPS: usize = 100;

/// Upper bound of `--steps`, time steps per tooth-passing period. A choice: with 20 000 steps the tool rotates by at
/// most 0.018 degrees in each step.
const STEPS_MAX: usize = 20_000;

/// Upper bound of `--harmonics`, harmonics of the directional coefficients. A choice: more make the truncated Hill
/// matrix too large to be useful.
const HARMONICS_MAX: usize = 400;

/// Copy of the case with the values that its wear and drift give the parameters after `after_s` seconds of operation.
///
/// # Errors
/// The case has neither wear nor drift, so that the time would change nothing; else as [`after`].
pub(super) fn case_after(case: &Case, after_s: f64) -> Result<Case, Error> {
    if !case.has(EffectName::Wear) && !case.has(EffectName::Drift) {
        return Err(Error::input(format!(
            "--after-s {after_s}: {} has neither [extension.wear] nor [extension.drift], so that nothing in it changes with time; \
             leave the option out, or add such a section",
            case.path.display()
        )));
    }
    Ok(after(case, after_s)?)
}

/// Stability method with its options.
#[derive(Debug, clap::Args)]
pub(super) struct MethodChoice {
    /// Stability method. Default: collocation; with --frf multi-frequency.
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// Table of receptances that replaces the structure of the case: frequency_hz,hxx_re [m/N],hxx_im [m/N],… or a
    /// table of mobility or accelerance, also as magnitude and phase.
    #[arg(long, value_name = "FILE")]
    frf: Option<PathBuf>,
    /// Meaning and unit of a column of --frf, such as Real=hxx_re:m/N,Imag=hxx_im:m/N, or hxx_mag, hxx_db,
    /// hxx_phase:deg, coherence_xx. Several with commas between; may be repeated.
    #[arg(long, value_name = "COLUMN=NAME[:UNIT],…", value_parser = ColumnMap::parse_list, requires = "frf")]
    map: Vec<ColumnMaps>,
    /// Highest harmonic of the directional coefficients in the stability computation. Default: multi-frequency adds
    /// harmonics until the limits converge; nyquist uses 0, the averaged coefficients.
    #[arg(long, value_name = "N", value_parser = harmonics)]
    harmonics: Option<usize>,
    /// Ignore the cubic terms of the structure: limits of the linear structure, valid for vanishing feed.
    #[arg(long)]
    linear: bool,
    /// Operating time in s for which the drift and wear of the case are evaluated.
    #[arg(long, value_name = "T", value_parser = non_negative, allow_negative_numbers = true)]
    after_s: Option<f64>,
    /// Time steps per tooth-passing period of sdm and fdm. Default: 100.
    #[arg(long, value_name = "N", value_parser = steps)]
    steps: Option<usize>,
    /// Order of sdm: interpolation of the delayed displacement within a step, constant (0) or linear (1).
    #[arg(long, value_name = "0|1", value_parser = order)]
    order: Option<SdmOrder>,
}

/// Stability methods that `--method` can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum MethodName {
    /// Collocation of the monodromy operator over the tooth period; over the revolution with variable pitch, about the
    /// forced periodic orbit with cubic terms.
    #[default]
    Collocation,
    /// Semi-discretization (Insperger, Stépán) with a fixed number of time steps.
    Sdm,
    /// First-order full discretization (Ding) with a fixed number of time steps.
    Fdm,
    /// Zeroth-order approximation (Altintas, Budak): averaged directional coefficients in closed form; does not find
    /// flips.
    Zoa,
    /// Nyquist criterion on the receptances: averaged directional coefficients, or periodic ones with --harmonics.
    Nyquist,
    /// Multi-frequency solution with harmonics of the directional coefficients; finds flips.
    MultiFrequency,
    /// Mode-coupling criterion without the regenerative effect, for comparison.
    ModeCoupling,
}

impl MethodChoice {
    /// Builds the chosen stability method for a case.
    ///
    /// # Errors
    /// For example: the method is not defined for the case, an option does not belong to the method, or the table of
    /// `--frf` cannot be read.
    pub(super) fn on(&self, case: &Case) -> Result<Box<dyn Method>, Error> {
        self.check_options()?;
        let moved;
        let case = match self.after_s {
            Some(after_s) => {
                moved = case_after(case, after_s)?;
                &moved
            }
            None => case,
        };
        if let Some(path) = &self.frf {
            let table = self.table(path)?.table;
            warn_of_table(&table)?;
            return self.on_receptances(FrequencyProblem::of_table(case, &table)?, path);
        }
        let needs_collocation = (needs_orbit(case) || depends_on_speed(case)) && !self.linear;
        // Only collocation computes limits about a forced orbit, as cubic terms require, and with cutting coefficients
        // that depend on the spindle speed. The other methods refuse cubic terms unless `--linear` removes them.
        let cubic = if self.linear {
            CubicTerms::LeaveOut
        } else {
            CubicTerms::Refuse
        };
        let steps = self.steps.unwrap_or(STEPS);
        Ok(match self.name() {
            MethodName::Collocation if needs_collocation => collocation_of(case)?,
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
            _ => return self.on_receptances(FrequencyProblem::new(case, cubic)?, &case.path),
        })
    }

    /// Reads the table of receptances in the file of `--frf`, with the meanings of its columns from `--map`.
    fn table(&self, path: &Path) -> Result<ImportedTable, Error> {
        let import = Import {
            map: self.map.iter().flat_map(|maps| maps.0.clone()).collect(),
            ..Import::default()
        };
        FrfTable::import(path, &import).map_err(Error::input)
    }

    /// Prints on stderr how the table of receptances in the file of `--frf` was understood, if it had to be
    /// interpreted.
    pub(super) fn announce(&self) -> Result<(), Error> {
        if let Some(path) = &self.frf
            && let Some(understood) = self.table(path)?.understood
        {
            progress::clear();
            eprintln!("understood: {understood}");
        }
        Ok(())
    }

    /// Sentences that state the assumptions behind the structure: those of the case, or with `--frf` those of the
    /// table.
    ///
    /// # Errors
    /// The table of `--frf` cannot be read.
    pub(super) fn assumptions(&self, case: &Case) -> Result<Vec<String>, Error> {
        let Some(path) = &self.frf else {
            return Ok(case.assumptions());
        };
        let missing = self.table(path)?.table.missing();
        let mut assumptions = Vec::new();
        if !missing.is_empty() {
            let names: Vec<String> = missing.iter().map(|name| format!("h{name}")).collect();
            assumptions.push(format!(
                "{} are zero, since {} lacks them",
                names.join(", "),
                path.display()
            ));
        }
        let is_missing = |wanted: &str| missing.iter().any(|name| name == wanted);
        if is_missing("xy") && is_missing("yx") && !is_missing("xx") && !is_missing("yy") {
            assumptions.extend(case.effect_of_uncoupled_xy());
        }
        if is_missing("zz") {
            assumptions.extend(case.effect_of_rigid_z());
        }
        Ok(assumptions)
    }

    fn name(&self) -> MethodName {
        self.method.unwrap_or(if self.frf.is_some() {
            MethodName::MultiFrequency
        } else {
            MethodName::default()
        })
    }

    /// Builds a stability method that uses receptances only; `path` is the table or the case
    /// that gives them, for error messages.
    fn on_receptances(&self, problem: FrequencyProblem, path: &Path) -> Result<Box<dyn Method>, Error> {
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
                    "{}: this method needs the equations of motion of the structure, which an FRF table does not contain; \
                     with --frf the methods are zoa, nyquist, multi-frequency and mode-coupling",
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
                "--steps is an option of --method sdm and fdm; the other methods choose their own mesh",
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
                "--harmonics 0 means averaged coefficients: use --method zoa or nyquist; multi-frequency needs 1 or more",
            ));
        }
        Ok(())
    }
}

/// Warns about receptances that a table of receptances lacks, about a possible mode below its first frequency line, and
/// about frequency lines that are too far apart.
fn warn_of_table(table: &FrfTable) -> Result<(), Error> {
    let file = table.path().display();
    for doubt in table_doubts(table) {
        tracing::warn!("{file}: {doubt}");
    }
    let missing = table.missing();
    if !missing.is_empty() {
        let names: Vec<String> = missing.iter().map(|name| format!("h{name}")).collect();
        tracing::warn!("{file}: the table has no {}; zero is assumed", names.join(", "));
    }
    for entry in table
        .entries()
        .iter()
        .filter(|entry| entry.response == entry.force)
    {
        // A direct receptance far below all modes is nearly its positive static compliance. With a phase beyond ±45° at
        // the first frequency line, a mode may lie below this line.
        if let (Some(first), Some(hz)) = (entry.receptance.first(), table.frequency_hz().first())
            && first.im.abs() > first.re
        {
            tracing::warn!(
                "{file}: h{} at its first line, {hz} Hz, is {} µm/N with an imaginary part of {} µm/N, not close to a static compliance: a mode may lie \
                 below the table",
                entry.name(),
                significant(1e6 * first.re, 3),
                significant(1e6 * first.im, 3),
            );
        }
    }
    let at_peak = |entry: &Frf| {
        let size = |line: &usize| entry.receptance[*line].norm();
        let peak = (0..entry.receptance.len()).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        Some(entry.folding.as_ref()?[peak])
    };
    let folding = table.entries().iter().filter_map(at_peak).fold(0.0, f64::max);
    if folding > SMALL_FOLDING {
        tracing::warn!(
            "{file}: content above half the sample rate may change the peaks of the receptances by up to {:.1} %; the errors of limits of fitted modes \
             contain it, those of other methods do not",
            100.0 * folding
        );
    }
    let error = Interpolation::new(table).map_err(Error::input)?.error();
    if error > COARSE_TABLE {
        tracing::warn!(
            "{file}: the interpolation error between the lines of the table is {:.1} % of its peak; a finer frequency resolution would help",
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
