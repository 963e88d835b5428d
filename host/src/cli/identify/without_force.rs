//! `--method output-only` and `--method inverse-stability`: modes without a measured force.

use super::Error;
use super::answer::{EstimatedMode, IdentifyOutput};
use super::args::Args;
use super::backbone_answer::average_warning;
use super::figure::Figure;
use super::written;
use crate::case::Case;
use crate::identify::ambient::Ambient;
use crate::identify::inverse_stability::{
    CutErrors, InverseMode, Posterior, PriorFactors, identified_modes, modes,
};
use crate::identify::observed_cut::ObservedCut;
use crate::identify::{case_file, subspace};
use crate::recording::{Recording, TestKind, cut_table};
use crate::report::digits::significant;
use crate::stability::{CubicTerms, Problem};

/// Identifies modes from a recording of motion under unmeasured excitation (operational modal analysis).
pub(super) fn output_only(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let [recording] = recordings else {
        return Err(Error::input(format!(
            "{} recordings are given; output-only uses one: give the longest",
            recordings.len()
        )));
    };
    let band_hz = match args.band_hz {
        Some([low, high]) if 0.0 < low && low < high && high < 0.5 * recording.sample_rate_hz => [low, high],
        _ => {
            return Err(Error::input(format!(
                "--band-hz: two frequencies below half the sample rate of {} Hz are needed, the lower first, as in 5:60",
                recording.sample_rate_hz
            )));
        }
    };
    let Some(ambient) = Ambient::new(recording, band_hz[1]) else {
        return Err(Error::input(
            recording.lacks("acceleration, velocity or displacement"),
        ));
    };
    let found = subspace::modes(&ambient, band_hz)
        .map_err(|error| Error::input(format!("{}: {error}", recording.path.display())))?;
    let mut warnings = Vec::new();
    if let Some(fault) = &ambient.tachometer_fault {
        warnings.push(format!(
            "the tachometer is ignored ({fault}); {}",
            match ambient.turn_hz {
                Some(turn_hz) => format!(
                    "the harmonics of the configured speed, {:.1} rev/min, are removed",
                    60.0 * turn_hz
                ),
                None => "no speed is configured, so the motion still contains the spindle harmonics".into(),
            }
        ));
    }
    if recording.sidecar.kind == Some(TestKind::FreeDecay) {
        warnings.extend(average_warning(recording, Some(band_hz)));
    }
    if ambient.harmonics_remain {
        warnings.push(
            "the record is too short to separate the spindle harmonics, which remain in the motion: a mode near one may be the harmonic"
                .into(),
        );
    }
    if recording.sidecar.kind == Some(TestKind::Cutting) {
        warnings.push(
            "this recording was made in a cut: the modes include the stiffness and damping of the cutting process"
                .into(),
        );
    }
    for mode in &found.modes {
        let Some(turn_hz) = ambient.turn_hz else { continue };
        let harmonic = (mode.frequency_hz / turn_hz).round() * turn_hz;
        if (harmonic - mode.frequency_hz).abs() < mode.damping_ratio * mode.frequency_hz {
            warnings.push(format!(
                "the mode at {:.3} Hz lies within its half-power bandwidth of the spindle harmonic at {harmonic:.3} Hz, which was removed; a recording at another speed is better",
                mode.frequency_hz
            ));
        }
    }
    let of_modes = found.modes.iter().map(|mode| EstimatedMode {
        frequency_hz: Figure::new(mode.frequency_hz, mode.frequency_deviation_hz),
        damping_ratio: Figure::new(mode.damping_ratio, mode.damping_deviation),
        stiffness_n_per_m: None,
        cannot_tell: if mode.is_vague() {
            vec!["damping_ratio"]
        } else {
            Vec::new()
        },
    });
    let of_modes: Vec<EstimatedMode> = of_modes.collect();
    let mut lines = vec![format!(
        "{} of {}, {:.1} s in {} blocks, {} states",
        ambient.names.join(", "),
        recording.path.display(),
        ambient.seconds(),
        found.blocks,
        found.order
    )];
    lines.extend(sentences(&of_modes));
    Ok(IdentifyOutput {
        modes: Some(of_modes),
        warnings,
        messages: lines,
        ..IdentifyOutput::of("output-only", Vec::new(), Vec::new())
    })
}

/// Identifies modes from a table of stable cuts and cuts with chatter.
pub(super) fn inverse_stability(args: &Args) -> Result<IdentifyOutput, Error> {
    let [path] = &args.recordings[..] else {
        return Err(Error::input(format!(
            "{} files are given; inverse-stability uses one table of cuts",
            args.recordings.len()
        )));
    };
    let table = cut_table::read(path)?;
    let cuts: Vec<ObservedCut> = table.iter().filter_map(ObservedCut::new).collect();
    if cuts.is_empty() {
        return Err(Error::input(format!(
            "{}: there are no cuts that were stable or chattered; a row for each cut is needed",
            path.display()
        )));
    }
    let marginal = table.len() - cuts.len();
    let Some(start) = &args.start else {
        return Err(Error::input(
            "--method inverse-stability needs --start CASE.toml: tool, material and cut, and an initial structure",
        ));
    };
    let case = Case::read(start)?;
    let problem = Problem::new(&case, CubicTerms::Refuse)?;
    let errors = CutErrors {
        depth: 0.01 * args.depth_error_percent,
        frequency: 0.01 * args.chatter_error_percent,
    };
    let prior = PriorFactors::default();
    let found = modes(&problem, &cuts, errors, prior, args.seed)
        .map_err(|error| Error::input(format!("{}: {error}", path.display())))?;
    let of_modes: Vec<EstimatedMode> = found.iter().map(of_mode).collect();
    let mut lines = vec![format!(
        "{} cuts; prior range: frequencies within a factor of {}, damping ratios and stiffnesses within a factor of {} of the initial structure",
        cuts.len(),
        prior.frequency,
        prior.damping
    )];
    lines.extend(sentences(&of_modes));
    let machine = case
        .structure()?
        .first_order()
        .map_err(|error| Error::input(format!("{}: {error}", start.display())))?;
    let (directions, identified) = identified_modes(&machine, &found);
    let name = written::case_file(&args.out)
        .and_then(std::path::Path::file_stem)
        .unwrap_or_default()
        .to_string_lossy();
    let warnings = (marginal > 0).then(|| {
        format!(
            "{}: {marginal} marginal cuts are ignored; they may lie on either side of the limit",
            path.display()
        )
    });
    Ok(IdentifyOutput {
        modes: Some(of_modes),
        warnings: warnings.into_iter().collect(),
        messages: lines,
        table: Some(case_file::modal(&name, &directions, &identified)),
        ..IdentifyOutput::of("inverse-stability", Vec::new(), Vec::new())
    })
}

fn of_mode(mode: &InverseMode) -> EstimatedMode {
    let figure = |spread: &Posterior| Figure {
        value: spread.value,
        ci90: spread.ci90,
    };
    let vague = [
        ("frequency_hz", mode.frequency_hz),
        ("damping_ratio", mode.damping_ratio),
        ("stiffness_n_per_m", mode.stiffness_n_per_m),
    ];
    EstimatedMode {
        frequency_hz: figure(&mode.frequency_hz),
        damping_ratio: figure(&mode.damping_ratio),
        stiffness_n_per_m: Some(figure(&mode.stiffness_n_per_m)),
        cannot_tell: vague
            .into_iter()
            .filter(|(_, spread)| spread.is_vague())
            .map(|(key, _)| key)
            .collect(),
    }
}

fn sentences(modes: &[EstimatedMode]) -> Vec<String> {
    let line = |index: usize, key: &str, figure: &Figure, vague: bool| {
        let [low, high] = figure.ci90;
        format!(
            "mode {} {key} = {}, 90 % interval {} to {}{}",
            index + 1,
            significant(figure.value, 6),
            significant(low, 6),
            significant(high, 6),
            if vague {
                ": not identifiable from the data"
            } else {
                ""
            }
        )
    };
    let mut lines = Vec::new();
    for (index, mode) in modes.iter().enumerate() {
        let figures = [
            ("frequency_hz", Some(&mode.frequency_hz)),
            ("damping_ratio", Some(&mode.damping_ratio)),
            ("stiffness_n_per_m", mode.stiffness_n_per_m.as_ref()),
        ];
        for (key, figure) in figures {
            let Some(figure) = figure else { continue };
            lines.push(line(index, key, figure, mode.cannot_tell.contains(&key)));
        }
    }
    lines
}
