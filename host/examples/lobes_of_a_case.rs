//! Stability lobes of a case: the limit at each speed, how stability is lost there, and one point of the chart.
//!
//! `cargo run --release -p quietcut --example lobes_of_a_case -- tests/cases/kuka-kr90-acetal.toml`

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use quietcut::case::Case;
use quietcut::stability::{Collocation, CubicTerms, Problem, chart, point, spaced};

fn main() -> Result<(), Box<dyn Error>> {
    let case = std::env::args().nth(1);
    let case = case.unwrap_or_else(|| "tests/cases/kuka-kr90-acetal.toml".into());
    print!("{}", limits(Path::new(&case))?);
    Ok(())
}

/// The first stability limit at speeds from 700 to 1300 rev/min, and the verdict at one point of the chart, as text.
pub fn limits(case: &Path) -> Result<String, Box<dyn Error>> {
    let case = Case::read(case)?;
    // With `CubicTerms::Refuse` a case with cubic terms is an error, because the limits of such a case depend on the
    // forced orbit; `quietcut::orbit::ForcedProblem` computes these limits.
    let problem = Problem::new(&case, CubicTerms::Refuse)?;
    let mut text = String::new();

    let method = Collocation {
        problem: problem.clone(),
    };
    // Limits at 13 spindle speeds from 700 to 1300 rev/min, searched at axial depths from 0 to 4 mm in 40 steps or
    // more.
    let chart = chart(&method, &spaced(700.0, 1300.0, 13), 4.0, 40)?;
    for line in &chart.speeds {
        match line.first_limit {
            Some(limit) => writeln!(
                text,
                "{:6.0} rev/min: stable up to {:.3} mm, then {:?} at {:.2} Hz",
                line.rpm,
                limit.depth_mm,
                limit.kind,
                limit.chatter_hz.unwrap_or(f64::NAN)
            )?,
            None => writeln!(text, "{:6.0} rev/min: stable up to 4 mm", line.rpm)?,
        }
    }

    // The dominant Floquet multiplier: above 1 in magnitude the cut is unstable.
    let dominant = point(&problem, 1045.0, 2.0)?;
    writeln!(
        text,
        "1045 rev/min, 2 mm: |Floquet multiplier| = {:.4}, {:?}",
        dominant.multiplier.norm(),
        dominant.verdict
    )?;
    Ok(text)
}
