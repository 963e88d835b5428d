//! Dominant Floquet multipliers at given points, for `quietcut lobes --at`.

use std::fmt::Write;

use serde::Serialize;

use super::lobes_spindle::Reach;
use super::{Error, Output, assumed};
use crate::case::Case;
use crate::report::digits::significant;
use crate::stability::{CutStability, Label, Method};

#[derive(Serialize)]
struct PointsOutput<'a> {
    #[serde(flatten)]
    label: Label,
    points: Vec<CutStability>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    assumed: &'a [String],
    /// Points that the spindle cannot reach.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    beyond_spindle: Vec<BeyondSpindle>,
}

/// A point that the spindle cannot reach, and why.
#[derive(Serialize)]
struct BeyondSpindle {
    rpm: f64,
    depth_mm: f64,
    /// `speed`, `power` or `torque`.
    by: &'static str,
}

/// Computes and prints the dominant Floquet multiplier at the points `at`, rev/min and mm.
pub(super) fn run(
    case: &Case,
    method: &dyn Method,
    at: &[(f64, f64)],
    assumed: &[String],
    output: Output,
) -> Result<(), Error> {
    let points = at
        .iter()
        .map(|&(rpm, depth_mm)| method.point(rpm, depth_mm))
        .collect::<Result<Vec<_>, _>>()?;
    let label = Label::of(method);
    let reach = Reach::of_case(case);
    let mut beyond_spindle = Vec::new();
    let mut text = format!("method: {label}");
    for point in &points {
        let chatter = point
            .chatter_hz
            .map_or_else(String::new, |hz| format!(", {hz:.2} Hz"));
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n{} rev/min, {} mm: {}, |Floquet multiplier| = {} ± {} ({}{chatter})",
            point.rpm,
            point.depth_mm,
            point.verdict.name(),
            modulus(point.multiplier_abs),
            significant(point.error, 1),
            point.kind.name(),
        );
        if let Some(by) = reach.beyond(point.rpm, point.depth_mm)? {
            let _ = write!(text, "; beyond the {by} of the spindle");
            beyond_spindle.push(BeyondSpindle {
                rpm: point.rpm,
                depth_mm: point.depth_mm,
                by,
            });
        }
    }
    text.push_str(&assumed::lines(assumed));
    let answer = PointsOutput {
        label,
        points,
        assumed,
        beyond_spindle,
    };
    output.answer(&answer, text)
}

/// Modulus of a Floquet multiplier as text: six decimals below 1000, seven significant digits from 1000 on.
fn modulus(value: f64) -> String {
    if value < 1e3 {
        format!("{value:.6}")
    } else {
        significant(value, 7)
    }
}
