//! What `quietcut bifurcation` is asked for: checked parameters, ranges and fixed values.

use super::super::Error;
use super::args::Args;
use super::names::{possible, word};
use crate::orbit::curve::Plane;
use crate::orbit::{ForcedProblem, Parameter, Setting};
use crate::stability::StabilityLoss;

/// Checked request.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Request {
    /// Parameter that varies along the branch.
    pub(super) vary: Parameter,
    /// Its first and last value.
    pub(super) range: [f64; 2],
    /// All parameters; that of `vary` has its first value.
    pub(super) setting: Setting,
    /// True if the period-doubled orbits of flips are followed.
    pub(super) doubled: bool,
    /// Values of the varied parameter at which cuts are simulated; empty without `--strobe`.
    pub(super) strobe: Vec<f64>,
    /// Curves in two parameters, if any.
    pub(super) curves: Option<CurveRequest>,
}

/// Curves of bifurcations in two parameters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CurveRequest {
    /// Kinds of the curves.
    pub(super) kinds: Vec<StabilityLoss>,
    /// The varied parameter and the other one, with their ranges.
    pub(super) plane: Plane,
    /// Both parameters as a chart shows them: horizontally and vertically.
    pub(super) shown: [Parameter; 2],
}

/// Example of a range of a parameter, for messages.
fn example(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Depth => "0:12 (mm)",
        Parameter::Rpm => "493:592 (rev/min)",
        Parameter::Feed => "0.05:0.25 (mm)",
        Parameter::Kappa | Parameter::Nu => "0:1",
    }
}

impl Request {
    /// The request of a command line for a forced problem.
    ///
    /// # Errors
    /// A value is missing, given twice, or not possible.
    pub(super) fn new(args: &Args, problem: &ForcedProblem) -> Result<Self, Error> {
        let vary = args.vary;
        let (range, other) = ranges(args)?;
        let mut setting = problem.setting(0.0, 0.0).with(vary, range[0]);
        for (index, &(parameter, value)) in args.fix.iter().enumerate() {
            let key = parameter.key();
            if parameter == vary {
                return Err(Error::input(format!(
                    "--fix {key}={value}: {} varies over {} to {}; fix another parameter or vary another one",
                    vary.name(),
                    range[0],
                    range[1]
                )));
            }
            if args.fix[..index].iter().any(|(earlier, _)| *earlier == parameter) {
                return Err(Error::input(format!(
                    "--fix {key}= is given twice; one value is needed"
                )));
            }
            setting = setting.with(parameter, value);
        }
        for parameter in [Parameter::Rpm, Parameter::Depth] {
            let is_given = parameter == vary || args.fix.iter().any(|(fixed, _)| *fixed == parameter);
            if !is_given {
                let (key, such) = match parameter {
                    Parameter::Rpm => ("rpm", "the spindle speed, such as --fix rpm=548"),
                    _ => ("depth_mm", "the axial depth, such as --fix depth_mm=7"),
                };
                return Err(Error::input(format!("--fix {key}= is missing: {such}")));
            }
        }
        let curves = match (args.plane, other) {
            (Some(shown), Some((parameter, other))) => {
                let value = setting.get(parameter);
                let [low, high] = [other[0].min(other[1]), other[0].max(other[1])];
                if !(low..=high).contains(&value) {
                    return Err(Error::input(format!(
                        "{} = {value}, where the curve begins, is outside its --range {low}:{high}; set --fix {}= within it",
                        parameter.key(),
                        parameter.key()
                    )));
                }
                Some(CurveRequest {
                    kinds: args.curve.clone(),
                    plane: Plane {
                        parameters: [vary, parameter],
                        ranges: [range, other],
                    },
                    shown,
                })
            }
            _ => None,
        };
        Ok(Self {
            vary,
            range,
            setting,
            doubled: args.doubled,
            strobe: if args.strobe {
                args.range[0].values()
            } else {
                Vec::new()
            },
            curves,
        })
    }

    /// The settings that decide the result, as words of the command line.
    pub(super) fn words(&self) -> Vec<(String, String)> {
        let pair = |[first, last]: [f64; 2]| format!("{first}:{last}");
        let mut words = vec![
            ("--vary".to_owned(), self.vary.name().to_owned()),
            ("--range".to_owned(), pair(self.range)),
        ];
        for parameter in Parameter::ALL.into_iter().filter(|other| *other != self.vary) {
            let value = self.setting.get(parameter).to_string();
            words.push((format!("--fix {}", parameter.key()), value));
        }
        if self.doubled {
            words.push(("--doubled".to_owned(), "given".to_owned()));
        }
        if let Some(curves) = &self.curves {
            let kinds: Vec<&str> = curves.kinds.iter().map(|kind| word(*kind)).collect();
            let names = curves.plane.parameters.map(Parameter::name);
            words.push(("--curve".to_owned(), kinds.join(",")));
            words.push(("--in".to_owned(), names.join(",")));
            words.push(("second --range".to_owned(), pair(curves.plane.ranges[1])));
        }
        words
    }
}

/// Parameter with its first and last value.
type Ranged = (Parameter, [f64; 2]);

/// Range of the varied parameter; with `--curve` also the other parameter of the plane with its range.
fn ranges(args: &Args) -> Result<([f64; 2], Option<Ranged>), Error> {
    let of = |parameter: Parameter, index: usize| -> Result<[f64; 2], Error> {
        let range = &args.range[index];
        let ends = [range.first(), range.last()];
        if ends[0] == ends[1] {
            return Err(Error::input(format!(
                "--range {}: the range of {} needs two different ends, such as {}",
                ends[0],
                parameter.name(),
                example(parameter)
            )));
        }
        for end in ends {
            let said = possible(parameter, end);
            said.map_err(|said| Error::input(format!("--range {}:{}: {said}", ends[0], ends[1])))?;
        }
        Ok(ends)
    };
    let Some(plane) = args.plane else {
        if args.range.len() > 1 {
            return Err(Error::input(
                "--range is given more than once; a second one belongs to --curve KIND --in P1,P2",
            ));
        }
        return Ok((of(args.vary, 0)?, None));
    };
    let other = match plane {
        [first, other] if first == args.vary => other,
        [other, second] if second == args.vary => other,
        _ => {
            return Err(Error::input(format!(
                "--in {},{}: one of both is the parameter of --vary, {}",
                plane[0].name(),
                plane[1].name(),
                args.vary.name()
            )));
        }
    };
    if args.range.len() != 2 {
        return Err(Error::input(format!(
            "--curve needs two --range, the first of {} and the second of {}, such as --range {} --range {}",
            args.vary.name(),
            other.name(),
            example(args.vary),
            example(other)
        )));
    }
    Ok((of(args.vary, 0)?, Some((other, of(other, 1)?))))
}
