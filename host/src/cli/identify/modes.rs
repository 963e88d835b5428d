//! `--method modes`: complex modes from receptances or from recordings of force and response.

use std::collections::BTreeMap;
use std::path::Path;

use maud::html;

use super::Error;
use super::answer::{ComplexFigure, ComplexMode, Figure, IdentifyOutput};
use super::args::Args;
use crate::frf::{
    Estimator, FrfError, FrfTable, ImportedTable, MeasurementSettings, RecordSpectra, measure, record_spectra,
};
use crate::identify::modes::{self, ChannelNoise, IdentifiedMode, ModalModel, Receptances};
use crate::recording::{Import, Understood};
use crate::report::page::{figure, page};
use crate::report::stabilization_chart::stabilization_chart;
use crate::structure::Direction;

/// Identifies complex modes from the receptances or recordings that the command line names.
pub(super) fn modes(args: &Args, understood: &mut Vec<Understood>) -> Result<IdentifyOutput, Error> {
    let options = &args.modes;
    if let Some(path) = &options.stabilization {
        ending(path)?;
    }
    let source = source(args, understood)?;
    let band_hz = args.band_hz;
    let refused =
        |error: modes::ModesError| Error::input(format!("{}: {error}", source.table.path().display()));
    let data = Receptances::new(&source.table, source.deviation.as_deref(), band_hz).map_err(refused)?;
    let wanted = modes::Options {
        highest_order: usize::from(options.order),
        modes: options.modes.map(usize::from),
    };
    let mut model = modes::identify(&data, &wanted).map_err(refused)?;
    let mut noise = Vec::new();
    if let Some(records) = &source.records {
        (model, noise) = modes::refine_by_records(&model, records).map_err(refused)?;
    }
    if let Some(percent) = options.calibration_percent {
        model.add_gain_errors(0.01 * percent);
    }
    if let Some(path) = &options.stabilization {
        draw(path, &data, &model)?;
    }
    let mut warnings = source.warnings;
    warnings.extend(model.warnings.iter().cloned());
    warnings.extend(not_in_case(args, &model));
    Ok(IdentifyOutput {
        method: "modes",
        complex_modes: model.modes.iter().map(|mode| of_mode(&model, mode)).collect(),
        rejected: model.rejected.clone(),
        coherence: coherence(&source.table, data.band_hz()),
        fit_error: Some(model.fit_error),
        misfit: model.misfit,
        warnings,
        messages: sentences(&model, &noise),
        noise,
        modal: Some(model),
        ..IdentifyOutput::default()
    })
}

/// Receptances from which the modes are identified, with their standard deviations by entry of the table and frequency
/// line. The standard deviations are `None` for a table from a file, and if a hammer test has fewer than three single
/// impacts or a test with periodic excitation one period.
struct Source {
    table: FrfTable,
    deviation: Option<Vec<Vec<f64>>>,
    warnings: Vec<String>,
    /// Spectra of the recorded forces and responses, by recording; `None` for a table of receptances, or if a recording
    /// is a hammer or step-sine test.
    records: Option<Vec<RecordSpectra>>,
}

fn source(args: &Args, understood: &mut Vec<Understood>) -> Result<Source, Error> {
    let mut no_table = None;
    if let [path] = args.recordings.as_slice() {
        match table(path, &args.segment.import())? {
            Ok(imported) => {
                if let Some(understood) = imported.understood {
                    crate::cli::progress::clear();
                    eprintln!("understood: {understood}");
                }
                return Ok(Source {
                    table: imported.table,
                    deviation: None,
                    warnings: Vec::new(),
                    records: None,
                });
            }
            Err(reason) => no_table = reason,
        }
    }
    let recorded = args
        .segment
        .read(&args.recordings)
        .map_err(|error| match no_table {
            Some(reason) => Error::input(format!("{error}; as a table of receptances: {reason}")),
            None => error,
        })?;
    let recordings = recorded.recordings;
    *understood = recorded.understood;
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
    let measurement = measure(&recordings, &settings)?;
    Ok(Source {
        table: measurement.table,
        deviation: measurement
            .has_deviation
            .iter()
            .all(|has| *has)
            .then_some(measurement.deviation),
        warnings: measurement.warnings,
        records: record_spectra(&recordings, &settings)?,
    })
}

/// Reads the table of receptances in a file. The inner error means that the file may be a recording: for a UFF file the
/// reason why no table was read, and `None` for another file that does not have the head of a table of receptances.
///
/// # Errors
/// A text file cannot be read, or has the head of a table of receptances but wrong content.
fn table(path: &Path, import: &Import) -> Result<Result<ImportedTable, Option<FrfError>>, Error> {
    match crate::file::ending(path).as_str() {
        "uff" | "unv" | "bunv" => Ok(FrfTable::import(path, import).map_err(Some)),
        _ if FrfTable::is_table(path)? => Ok(Ok(FrfTable::import(path, import)?)),
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

fn of_mode(model: &ModalModel, found: &IdentifiedMode) -> ComplexMode {
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
    }
}

/// Warning about directions of forces or responses that the written case file does not contain, since a case needs
/// directions that are both excited and measured. `None` if the case file contains all or none of the directions, or if
/// no case file is written.
fn not_in_case(args: &Args, model: &ModalModel) -> Option<String> {
    args.out.as_ref()?;
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

fn sentences(model: &ModalModel, noise: &[ChannelNoise]) -> Vec<String> {
    let mut lines = Vec::new();
    for found in &model.modes {
        let frequency = Figure::new(found.mode.frequency_hz, found.frequency_std_hz);
        let damping = Figure::new(found.mode.damping_ratio, found.damping_ratio_std);
        lines.push(format!(
            "mode at {:.4} Hz (90 % interval {:.4} to {:.4}), damping ratio {:.5} ({:.5} to {:.5})",
            frequency.value,
            frequency.ci90[0],
            frequency.ci90[1],
            damping.value,
            damping.ci90[0],
            damping.ci90[1]
        ));
        let shapes = [
            ("right", &model.responses, &found.mode.right, &found.right_std),
            ("left", &model.forces, &found.mode.left, &found.left_std),
        ];
        for (name, directions, values, deviations) in shapes {
            let entries: Vec<String> = directions
                .iter()
                .zip(values.iter().zip(deviations))
                .map(|(direction, (value, [re, im]))| {
                    format!(
                        "{direction} {:.3}{:+.3}i (±{:.3}, ±{:.3})",
                        1e3 * value.re,
                        1e3 * value.im,
                        1e3 * re,
                        1e3 * im
                    )
                })
                .collect();
            lines.push(format!(
                "  {name} shape, 10⁻³ (one standard deviation): {}",
                entries.join(", ")
            ));
        }
    }
    for channel in noise {
        lines.push(format!(
            "noise of {} in {}: {:.3} % of its root mean square",
            channel.channel, channel.recording, channel.percent
        ));
    }
    for pole in &model.rejected {
        lines.push(format!(
            "rejected pole: {:.3} Hz, damping ratio {:.4}: {}",
            pole.frequency_hz, pole.damping_ratio, pole.why
        ));
    }
    lines
}

#[derive(Clone, Copy)]
enum ChartFormat {
    Svg,
    Html,
}

fn ending(path: &Path) -> Result<ChartFormat, Error> {
    match crate::file::ending(path).as_str() {
        "svg" => Ok(ChartFormat::Svg),
        "html" => Ok(ChartFormat::Html),
        other => Err(Error::input(format!(
            "--stabilization {}: it ends in \"{other}\"; svg or html is needed",
            path.display()
        ))),
    }
}

fn draw(path: &Path, data: &Receptances, model: &ModalModel) -> Result<(), Error> {
    let title = "Stabilization diagram";
    let svg = stabilization_chart(title, data, model).map_err(Error::input)?;
    let text = match ending(path)? {
        ChartFormat::Svg => svg,
        ChartFormat::Html => {
            let body = html! {
                h1 { (title) }
                (figure(&svg, "Poles whose frequency, damping and mode shape stay constant as the model order increases are modes. Below: measured receptances and their fit."))
                table {
                    tr { th { "frequency" } th { "damping ratio" } th { "reason for rejection" } }
                    @for pole in &model.rejected {
                        tr {
                            td { (format!("{:.3} Hz", pole.frequency_hz)) }
                            td { (format!("{:.4}", pole.damping_ratio)) }
                            td { (pole.why) }
                        }
                    }
                }
            };
            page(title, &body)
        }
    };
    Ok(crate::file::write(path, text.as_bytes())?)
}
