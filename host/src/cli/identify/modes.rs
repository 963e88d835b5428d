//! `--method modes`: complex modes from receptances or from recordings of force and response.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::Error;
use super::answer::{ComplexFigure, ComplexMode, IdentifyOutput, Modal};
use super::args::Args;
use super::figure::Figure;
use super::mode_lines::lines;
use super::modes_comparison::ModesComparison;
use super::stabilization_diagram::{CAPTION, TITLE, ending, write_diagram};
use super::written;
use crate::case::Case;
use crate::cli::frf::warn_of_folding;
use crate::frf::{
    Estimator, FrfError, FrfTable, ImportedTable, MeasurementSettings, RecordSpectra, measure,
    record_spectra, table_doubts,
};
use crate::identify::modes::{self, ChannelNoise, ComparedMode, MadeApart, ModalModel, Receptances};
use crate::machine::spindle_rpm;
use crate::recording::{Format, Import, Understood};
use crate::report::stabilization_chart::stabilization_chart;
use crate::structure::Direction;

/// Identifies complex modes from the receptances or recordings that the command line names. With `--compare` they are compared with those of
/// another file; then the first may be a case too.
pub(super) fn modes(args: &Args, understood: &mut Vec<Understood>) -> Result<IdentifyOutput, Error> {
    let Some(other) = &args.modes.compare else {
        return identified(args, understood, &args.recordings).map(|(answer, _)| answer);
    };
    let (mut answer, after) = match args.recordings.as_slice() {
        [case] if is_case(case) => {
            let answer = IdentifyOutput {
                method: "modes",
                ..IdentifyOutput::default()
            };
            (answer, of_case(case)?)
        }
        recordings => {
            let (answer, model) = identified(args, understood, recordings)?;
            (answer, ComparedMode::of_model(&model))
        }
    };
    let before = if is_case(other) {
        of_case(other)?
    } else {
        let model = model_of(args, understood, std::slice::from_ref(other))?.model;
        ComparedMode::of_model(&model)
    };
    let comparison = ModesComparison::new(other, &before, &after)?;
    answer.messages.extend(comparison.lines());
    answer.comparison = Some(comparison);
    Ok(answer)
}

fn is_case(path: &Path) -> bool {
    crate::file::ending(path) == "toml"
}

fn of_case(path: &Path) -> Result<Vec<ComparedMode>, Error> {
    let case = Case::read(path).map_err(Error::input)?;
    case.structure().map_err(Error::input)?;
    ComparedMode::of_case(&case).map_err(|error| Error::input(format!("{}: {error}", path.display())))
}

/// A modal model and the data to which it was fitted.
struct Fitted {
    source: Source,
    data: Receptances,
    model: ModalModel,
    noise: Vec<ChannelNoise>,
}

fn model_of(args: &Args, understood: &mut Vec<Understood>, recordings: &[PathBuf]) -> Result<Fitted, Error> {
    let options = &args.modes;
    let source = source(args, understood, recordings)?;
    let refused =
        |error: modes::ModesError| Error::input(format!("{}: {error}", source.table.path().display()));
    let data = Receptances::new(&source.table, source.deviation.as_deref(), args.band_hz).map_err(refused)?;
    let wanted = modes::Options {
        highest_order: usize::from(options.order),
        modes: options.modes.map(usize::from),
    };
    let mut model = modes::identify(&data, &wanted).map_err(|error| {
        // What is doubtful about the receptances may be the reason.
        let doubts = source.warnings.iter().map(|doubt| format!("; {doubt}"));
        Error::input(format!("{}{}", refused(error), doubts.collect::<String>()))
    })?;
    let mut noise = Vec::new();
    // A fit to whole records needs every response to every force in each record.
    let records = source.records.as_ref();
    if let Some(records) = records.filter(|_| model.not_measured().is_empty()) {
        (model, noise) = modes::refine_by_records(&model, records).map_err(refused)?;
    }
    model.add_folding_errors(&data, MadeApart::Forces);
    if let Some(percent) = options.calibration_percent {
        model.add_gain_errors(0.01 * percent);
    }
    Ok(Fitted {
        source,
        data,
        model,
        noise,
    })
}

fn identified(
    args: &Args,
    understood: &mut Vec<Understood>,
    recordings: &[PathBuf],
) -> Result<(IdentifyOutput, ModalModel), Error> {
    if let Some(path) = &args.modes.stabilization {
        ending(path)?;
    }
    let Fitted {
        source,
        data,
        model,
        noise,
    } = model_of(args, understood, recordings)?;
    let mut picture = None;
    if args.modes.stabilization.is_some() || written::wants_picture(&args.out) {
        let svg = stabilization_chart(TITLE, &data, &model).map_err(Error::input)?;
        if let Some(path) = &args.modes.stabilization {
            write_diagram(path, &svg, &model)?;
        }
        picture = Some((svg, CAPTION));
    }
    let structure_rpm = source.structure_rpm;
    let mut warnings = source.warnings;
    warnings.extend(model.warnings.iter().cloned());
    warnings.extend(not_in_case(args, &model));
    warnings.extend(uncoupled(&model));
    let mac = model.modal_assurance().map(|mac| {
        let row = |row: usize| mac.row(row).iter().copied().collect();
        (0..mac.nrows()).map(row).collect()
    });
    let answer = IdentifyOutput {
        method: "modes",
        complex_modes: (0..model.modes.len())
            .map(|index| of_mode(&model, index))
            .collect(),
        rejected: model.rejected.clone(),
        coherence: coherence(&source.table, data.band_hz()),
        fit_error: Some(model.fit_error),
        misfit: model.misfit,
        warnings,
        messages: lines(&model, &noise, mac.as_deref()),
        mac,
        noise,
        picture,
        modal: Some(model.clone()),
        structure_rpm,
        ..IdentifyOutput::default()
    };
    Ok((answer, model))
}

/// Receptances from which the modes are identified, with their standard deviations by entry of the table and frequency
/// line. The standard deviations are `None` for a table from a file, and if a hammer test has fewer than three single
/// impacts or a test with periodic excitation one period.
struct Source {
    table: FrfTable,
    deviation: Option<Vec<Vec<f64>>>,
    warnings: Vec<String>,
    /// Spindle speed that the recordings state, rev/min; `None` likewise.
    structure_rpm: Option<f64>,
    /// Spectra of the recorded forces and responses, by recording; `None` for a table of receptances, or if a recording
    /// is a hammer or step-sine test.
    records: Option<Vec<RecordSpectra>>,
}

fn source(args: &Args, understood: &mut Vec<Understood>, recordings: &[PathBuf]) -> Result<Source, Error> {
    let mut no_table = None;
    if let [path] = recordings {
        match table(path, &args.segment.import())? {
            Ok(imported) => {
                if let Some(understood) = imported.understood {
                    crate::cli::progress::clear();
                    eprintln!("understood: {understood}");
                }
                return Ok(Source {
                    warnings: table_doubts(&imported.table),
                    table: imported.table,
                    deviation: None,
                    structure_rpm: None,
                    records: None,
                });
            }
            Err(reason) => no_table = reason,
        }
    }
    let recorded = args.segment.read(recordings).map_err(|error| match no_table {
        Some(reason) => Error::input(format!("{error}; as a table of receptances: {reason}")),
        None => error,
    })?;
    let recordings = recorded.recordings;
    understood.extend(recorded.understood);
    let settings = MeasurementSettings {
        resolution_hz: args.modes.resolution_hz,
        estimator: if args.modes.pseudo_inverse {
            Estimator::PseudoInverse
        } else {
            Estimator::H1
        },
        band_hz: args.band_hz.map(|[low, high]| (low, high)),
        ..MeasurementSettings::default()
    };
    let mut measurement = measure(&recordings, &settings)?;
    warn_of_folding(&mut measurement, &recordings);
    Ok(Source {
        table: measurement.table,
        deviation: measurement
            .has_deviation
            .iter()
            .all(|has| *has)
            .then_some(measurement.deviation),
        warnings: measurement.warnings,
        structure_rpm: spindle_rpm(&recordings),
        records: record_spectra(&recordings, &settings)?,
    })
}

/// Reads the table of receptances in a file. The inner error means that the file may be a recording: for a UFF file the
/// reason why no table was read, and `None` for another file that does not have the head of a table of receptances.
///
/// # Errors
/// A text file cannot be read, or has the head of a table of receptances but wrong content.
fn table(path: &Path, import: &Import) -> Result<Result<ImportedTable, Option<FrfError>>, Error> {
    match Format::of(path) {
        Ok(Format::Uff) => Ok(FrfTable::import(path, import).map_err(Some)),
        _ if FrfTable::is_table(path, import)? => Ok(Ok(FrfTable::import(path, import)?)),
        _ => Ok(Err(None)),
    }
}

/// Median over a frequency band of the coherence of each response, by direction of the response. The last receptance of
/// a response in the table that has coherence in the band counts; a response without one is missing.
fn coherence(table: &FrfTable, [from_hz, to_hz]: [f64; 2]) -> BTreeMap<&'static str, f64> {
    let mut medians = BTreeMap::new();
    for entry in table.entries() {
        let Some(coherence) = &entry.coherence else {
            continue;
        };
        let mut inside: Vec<f64> = coherence
            .iter()
            .zip(table.frequency_hz())
            .filter(|(_, hertz)| (from_hz..=to_hz).contains(*hertz))
            .map(|(value, _)| *value)
            .collect();
        inside.sort_by(f64::total_cmp);
        if let Some(median) = inside.get(inside.len() / 2) {
            medians.insert(entry.response.name(), *median);
        }
    }
    medians
}

fn of_mode(model: &ModalModel, index: usize) -> ComplexMode {
    let found = &model.modes[index];
    let shape = |directions: &[Direction], values: &[num_complex::Complex64], deviations: &[[f64; 2]]| {
        let entries = directions.iter().zip(values).zip(deviations);
        entries
            .map(|((direction, value), deviation)| {
                let parts = ComplexFigure {
                    re: Figure::new(value.re, deviation[0]),
                    im: Figure::new(value.im, deviation[1]),
                };
                (direction.name(), parts)
            })
            .collect()
    };
    ComplexMode {
        frequency_hz: Figure::new(found.mode.frequency_hz, found.frequency_std_hz),
        damping_ratio: Figure::new(found.mode.damping_ratio, found.damping_ratio_std),
        left: shape(&model.forces, &found.mode.left, &found.left_std),
        right: shape(&model.responses, &found.mode.right, &found.right_std),
        modal: model.modal_parameters(index).map(|modal| {
            let figure = |[value, std]: [f64; 2]| Figure::new(value, std);
            Modal {
                direction: modal.direction.name(),
                mass_kg: figure(modal.mass_kg),
                damping_ns_per_m: figure(modal.damping_ns_per_m),
                stiffness_n_per_m: figure(modal.stiffness_n_per_m),
                phase_deg: modal.phase_rad.to_degrees(),
            }
        }),
    }
}

/// Warning about directions of forces or responses that the written case file does not contain, since a case needs
/// directions that are both excited and measured. `None` if the case file contains all or none of the directions, or if
/// no case file is written.
fn not_in_case(args: &Args, model: &ModalModel) -> Option<String> {
    written::case_file(&args.out)?;
    let directions = model.directions();
    let left_out: Vec<&str> = model
        .responses
        .iter()
        .chain(&model.forces)
        .filter(|direction| !directions.contains(direction))
        .map(|direction| direction.name())
        .collect();
    (!left_out.is_empty() && !directions.is_empty()).then(|| {
        format!(
            "the case does not contain {}: a mode shape requires that the direction is both excited and measured",
            left_out.join(", ")
        )
    })
}

/// Warning of the receptances that were not measured and are taken as zero; `None` if there are none.
fn uncoupled(model: &ModalModel) -> Option<String> {
    let zero: Vec<String> = model
        .not_measured()
        .iter()
        .map(|(p, q)| format!("h{p}{q}"))
        .collect();
    (!zero.is_empty()).then(|| {
        format!(
            "{} were not measured and are taken as zero: the directions are identified one by one, as uncoupled; a mode oblique to them appears once \
             in each",
            zero.join(", ")
        )
    })
}
