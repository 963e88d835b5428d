//! `quietcut bifurcation`: branches of forced periodic orbits over one parameter, and curves of their torus, flip and
//! fold points over two.

mod answer;
mod args;
mod computed;
mod doubled;
mod files;
mod names;
mod orbit_entry;
mod records;
mod request;
mod strobe;
mod summary;

use std::fmt::Write;

use super::Error;
use super::output::keep_inputs;
use super::plausible_structure;
use crate::case::Case;
use crate::file;
use crate::orbit::{Event, ForcedProblem};
use crate::stability::depends_on_speed;
use answer::BifurcationOutput;
pub use args::Args;
use computed::{Computed, compute};
use files::Shown;
use records::{Head, Records};
use request::Request;

/// Error of a bifurcation, as a share of the range of its parameter, from which on a warning says so: a point of a chart
/// is then visibly off.
const LARGE_ERROR: f64 = 0.01;

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let case = Case::read(&args.case)?;
    for out in &args.out {
        keep_inputs([args.case.as_path()], out)?;
    }
    if depends_on_speed(&case) {
        return Err(Error::input(format!(
            "{}: the structure or the cutting coefficients depend on the spindle speed, which branches do not cover; leave that \
             dependence out, or compute limits at each speed (quietcut lobes)",
            case.path.display()
        )));
    }
    plausible_structure::warn(&case);
    let problem = ForcedProblem::new(&case)?;
    let request = Request::new(&args, &problem)?;
    let head = Head::new(&file::read(&args.case)?, request.words());
    let mut records = match (&args.resume, args.out.first()) {
        (Some(path), _) => Records::resumed(path, &head)?,
        (None, Some(out)) => Records::beside(out, &head)?,
        (None, None) => Records::default(),
    };
    let mut computed = match compute(&problem, &request, &mut records) {
        Ok(computed) => computed,
        Err(error) => {
            records.discard();
            return Err(error);
        }
    };
    computed.strobe = strobe::strobe(&case, &request, &request.strobe)?;
    warn_of_errors(&args, &computed);
    let shown = Shown {
        name: &case.name,
        request: &request,
        teeth: problem.linear.teeth,
        computed: &computed,
    };
    for path in &args.out {
        shown.write(path)?;
    }
    let recorded = records.finish()?;
    let mut text = summary::text(&request, problem.linear.teeth, &computed);
    for path in args.out.iter().chain(&recorded) {
        // Writing to a String cannot fail.
        let _ = write!(text, "\n{}", path.display());
    }
    let answer = BifurcationOutput::new(&request, problem.linear.teeth, &computed);
    args.output.answer(&answer, text)?;
    match &computed.broken {
        None => Ok(()),
        Some(broken) => Err(Error::other(format!(
            "the branch ends early: {}; {}",
            broken.reason, broken.try_instead
        ))),
    }
}

/// Warns about bifurcations whose error is large or cannot be computed.
fn warn_of_errors(args: &Args, computed: &Computed) {
    let points = &computed.branch.points;
    let values = || points.iter().map(|point| point.value);
    let length = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
    let is_large = |event: &&Event| event.error > LARGE_ERROR * length;
    for event in computed.branch.events.iter().filter(is_large) {
        tracing::warn!(
            "{}: the {} at {} = {:.5} has an error of {:.1e} or more: the mesh is too coarse for the motion there, or the multiplier hardly \
             moves along the branch; vary another parameter through it, or a shorter --range",
            args.case.display(),
            names::word(event.kind),
            args.vary.key(),
            event.value,
            event.error
        );
    }
    for curve in &computed.curves {
        let ranges = curve.parameters.iter().zip(curve.error);
        for (parameter, error) in ranges.filter(|(_, error)| !error.is_finite()) {
            tracing::warn!(
                "{}: the error of the {} curve in {} cannot be computed ({error}): the mesh is too coarse for the motion at one of its \
                 ends; a shorter --range may avoid it",
                args.case.display(),
                names::word(curve.kind),
                parameter.key()
            );
        }
    }
}
