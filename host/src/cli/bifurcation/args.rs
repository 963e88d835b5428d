//! Arguments of `quietcut bifurcation`.

use std::path::PathBuf;

use super::super::{Endings, Output, Range, finite};
use super::names::{possible, word};
use crate::orbit::Parameter;
use crate::stability::StabilityLoss;

/// Follows forced periodic orbits over one parameter, and finds the torus, flip and fold points at which they lose or
/// regain stability.
///
/// The orbit is the vibration that the teeth force; its Floquet multipliers are those of the delay equation linearized
/// about it. The stability limit is the first loss along the branch. Later bifurcations lie on orbits that are unstable
/// already.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut bifurcation tests/cases/kuka-kr90-full-cubic.toml --vary depth --range 0:12 --fix rpm=548.2 --out branch.svg\n  quietcut bifurcation tests/cases/kuka-kr90-full-cubic.toml --vary kappa --range 0:1 --fix rpm=548.2 --fix depth_mm=8\n  quietcut bifurcation tests/cases/kuka-kr90-full-cubic.toml --vary depth --range 0:12 --fix rpm=548.2 --curve torus --in rpm,depth --range 493:592 --out curve.svg"
)]
pub struct Args {
    /// The case file: structure, tool, material, cut.
    #[arg(value_name = "CASE")]
    pub(super) case: PathBuf,
    /// Parameter that varies along the branch: depth, rpm, feed (per tooth), kappa (factor on the cubic stiffness) or nu
    /// (factor on the cubic damping).
    #[arg(long, value_name = "P", value_parser = parameter)]
    pub(super) vary: Parameter,
    /// Range of the varied parameter, first:last or first:last:count, in mm, rev/min, or as a factor; the branch begins at the first value, and the
    /// count is that of --strobe. With
    /// --curve a second --range is that of the other parameter of --in.
    #[arg(long, value_name = "R", required = true)]
    pub(super) range: Vec<Range>,
    /// Value of a parameter that does not vary: rpm=, depth_mm=, feed_mm=, kappa= or nu=. Without it, the feed is that of the
    /// case, and kappa and nu are 1. With --curve: where the branch lies on which the curve begins. May be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = fixed)]
    pub(super) fix: Vec<(Parameter, f64)>,
    /// Follow the losses of this kind in two parameters: torus, flip or fold. Each one on the branch begins a curve. May be
    /// repeated.
    #[arg(long, value_name = "KIND", value_parser = kind, requires = "plane")]
    pub(super) curve: Vec<StabilityLoss>,
    /// Both parameters of the curves, P1,P2; a chart shows P1 horizontally and P2 vertically. One is that of --vary.
    #[arg(long = "in", value_name = "P1,P2", value_parser = plane, requires = "curve")]
    pub(super) plane: Option<[Parameter; 2]>,
    /// Follow the period-doubled orbits from each flip at which the forced orbits lose or regain stability. Where they turn back in a
    /// fold below a subcritical flip, a cut is bistable: stable unless something knocks it.
    #[arg(long)]
    pub(super) doubled: bool,
    /// Simulate a cut at each value of --range, first:last:count (61 without a count), and show the displacement of the tool
    /// once per tooth passing behind the branch: a stroboscopic bifurcation diagram.
    #[arg(long)]
    pub(super) strobe: bool,
    /// Chart, page or table to write; the ending sets the format: svg, html, json or csv. May be repeated. While the orbits
    /// are computed they are recorded in FILE.part.jsonl beside the first one, which is FILE.jsonl at the end.
    #[arg(long, value_name = "FILE", value_parser = Endings(&["svg", "html", "json", "csv"]).parser())]
    pub(super) out: Vec<PathBuf>,
    /// Go on from the orbits that an interrupted run of the same command has recorded: FILE.part.jsonl.
    #[arg(long, value_name = "FILE", value_parser = Endings(&["jsonl"]).parser())]
    pub(super) resume: Option<PathBuf>,
    #[command(flatten)]
    pub(super) output: Output,
}

fn kind(text: &str) -> Result<StabilityLoss, String> {
    let kinds = [StabilityLoss::Hopf, StabilityLoss::Flip, StabilityLoss::Fold];
    kinds
        .into_iter()
        .find(|kind| word(*kind) == text)
        .ok_or_else(|| format!("`{text}` is no kind of bifurcation; possible: torus, flip, fold"))
}

fn parameter(text: &str) -> Result<Parameter, String> {
    let names = Parameter::ALL.map(Parameter::name);
    Parameter::ALL
        .into_iter()
        .find(|parameter| parameter.name() == text)
        .ok_or_else(|| format!("`{text}` is no parameter; possible: {}", names.join(", ")))
}

fn plane(text: &str) -> Result<[Parameter; 2], String> {
    let form = || format!("`{text}` is not of the form P1,P2, such as rpm,depth");
    let (first, second) = text.split_once(',').ok_or_else(form)?;
    let [first, second] = [parameter(first.trim())?, parameter(second.trim())?];
    if first == second {
        return Err(format!(
            "`{text}`: two different parameters are needed, such as rpm,depth"
        ));
    }
    Ok([first, second])
}

fn fixed(text: &str) -> Result<(Parameter, f64), String> {
    let keys = Parameter::ALL.map(Parameter::key);
    let (key, value) = text
        .split_once('=')
        .ok_or_else(|| format!("`{text}` is not of the form NAME=VALUE, such as rpm=548"))?;
    let parameter = Parameter::ALL
        .into_iter()
        .find(|parameter| parameter.key() == key)
        .ok_or_else(|| {
            let meant = Parameter::ALL
                .into_iter()
                .find(|parameter| parameter.name() == key);
            let meant = meant.map_or_else(String::new, |meant| format!("; write {}={value}", meant.key()));
            format!(
                "`{key}` is no name of a value; possible: {}{meant}",
                keys.join(", ")
            )
        })?;
    let value = finite(value)?;
    possible(parameter, value)?;
    Ok((parameter, value))
}
