//! Diagnosis of a folder of recordings: the causes for which the simulation of a case differs from them.
//!
//! `cargo run --release -p quietcut --example diagnose_a_folder -- CASE.toml FOLDER`

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use quietcut::case::Case;
use quietcut::diagnose::{Options, diagnose};
use quietcut::recording::Recording;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let (Some(case), Some(folder)) = (arguments.next(), arguments.next()) else {
        return Err("name a case and a folder: diagnose_a_folder CASE.toml FOLDER".into());
    };
    print!("{}", causes(&case, &folder)?);
    Ok(())
}

/// The outcome of the diagnosis, the causes with their parameters, and the prediction error (NRMSE) on held-out
/// segments of the case and, if there is one, of the extended case, as text.
pub fn causes(case: &Path, folder: &Path) -> Result<String, Box<dyn Error>> {
    let case = Case::read(case)?;
    let mut paths: Vec<_> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    // The `.toml` files are the sidecars of the recordings; `Recording::read` finds them itself.
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "csv"));
    paths.sort();
    let recordings = paths.iter().map(Recording::read).collect::<Result<Vec<_>, _>>()?;

    let diagnosis = diagnose(&case, &recordings, &Options::default())?;
    let mut text = String::new();
    writeln!(text, "{} recordings: {:?}", recordings.len(), diagnosis.outcome)?;
    for cause in &diagnosis.causes {
        writeln!(text, "  {} (confidence {:.2})", cause.name, cause.confidence)?;
        for (key, estimate) in &cause.parameters {
            let [low, high] = estimate.ci90;
            writeln!(
                text,
                "    {key} = {:.4e}, 90 % interval {low:.4e} to {high:.4e}",
                estimate.value
            )?;
        }
    }
    writeln!(
        text,
        "prediction error: {:.1} %",
        100.0 * diagnosis.baseline.nrmse_heldout
    )?;
    if let Some(extended) = &diagnosis.extended {
        writeln!(text, "with these causes: {:.1} %", 100.0 * extended.nrmse_heldout)?;
    }
    Ok(text)
}
