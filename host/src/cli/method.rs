//! The methods that `--method` knows, and their options.

use super::Error;
use crate::case::Case;
use crate::continuation::ForcedProblem;
use crate::stability::{
    Collocation, CubicTerms, Fdm, FullDiscretization, Method, Pitched, Problem, Sdm, SdmOrder,
    SemiDiscretization,
};

/// Steps per tooth period where none are asked for.
const STEPS: usize = 100;

/// The most steps per tooth period: a step of a thousandth of a degree is finer than any table of coefficients.
const STEPS_MAX: usize = 20_000;

/// How to compute.
#[derive(Debug, clap::Args)]
pub(super) struct MethodChoice {
    /// How to compute.
    #[arg(long, value_enum, default_value_t)]
    method: MethodName,
    /// Leave out the cubic terms of a structure: the limits for vanishing feed.
    #[arg(long)]
    linear: bool,
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
    /// Collocation of the one-period map; with cubic terms about the forced orbit.
    #[default]
    Collocation,
    /// Semi-discretization with a fixed number of steps.
    Sdm,
    /// Full discretization of first order with a fixed number of steps.
    Fdm,
}

impl MethodChoice {
    /// The method on a case.
    ///
    /// # Errors
    /// The method is not defined for the case, or an option is not one of the method.
    pub(super) fn on(&self, case: &Case) -> Result<Box<dyn Method>, Error> {
        self.check_options()?;
        let has_cubic_terms = case.structure().map_err(Error::input)?.is_nonlinear() && !self.linear;
        // All but the default know limits for vanishing feed only: they refuse cubic terms unless these are left out.
        let cubic = if self.linear {
            CubicTerms::LeaveOut
        } else {
            CubicTerms::Refuse
        };
        let steps = self.steps.unwrap_or(STEPS);
        Ok(match self.method {
            MethodName::Collocation if has_cubic_terms => Box::new(ForcedProblem::new(case)?),
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
        })
    }

    fn check_options(&self) -> Result<(), Error> {
        let in_steps = matches!(self.method, MethodName::Sdm | MethodName::Fdm);
        if self.steps.is_some() && !in_steps {
            return Err(Error::input(
                "--steps is an option of --method sdm and fdm; others choose steps of their own",
            ));
        }
        if self.order.is_some() && self.method != MethodName::Sdm {
            return Err(Error::input("--order is an option of --method sdm"));
        }
        Ok(())
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
