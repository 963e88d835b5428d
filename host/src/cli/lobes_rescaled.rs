//! `quietcut lobes --rescale`: a case whose natural frequencies follow from check cuts.

use std::path::Path;

use serde::Serialize;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, TableLike, Value};

use super::{Error, positive};
use crate::case::Case;
use crate::file;
use crate::report::digits::significant;
use crate::stability::rescaling::{CheckCut, RescaledMode, Rescaling, rescaling};
use crate::trial_cuts::TrialCut;
use quietcut_numerics::statistics::NINETY_PERCENT;

/// Default of `--chatter-error-percent`, the same as of `identify --method inverse-stability`. A choice.
const CHATTER_ERROR_PERCENT: f64 = 0.3;

/// Options of `--rescale`.
#[derive(Debug, clap::Args)]
pub(super) struct RescaleOptions {
    /// Rescale the case by the trial cuts that chattered at a measured frequency (column chatter_hz): the natural frequency of the mode that
    /// chattered is multiplied so that the predicted chatter frequency is the measured one, at constant modal mass and damping ratio. For a
    /// structure that was measured at standstill; cut a little above the limit.
    #[arg(long, requires = "cuts", conflicts_with_all = ["frf", "at_speed"])]
    rescale: bool,
    /// For --rescale: standard deviation of each measured chatter frequency, in percent of the frequency.
    #[arg(long, value_name = "P", default_value_t = CHATTER_ERROR_PERCENT, requires = "rescale", value_parser = positive, allow_negative_numbers = true)]
    chatter_error_percent: f64,
}

impl RescaleOptions {
    /// The rescaled case; `None` without `--rescale`.
    ///
    /// # Errors
    /// No cut identifies the natural frequency of a mode, or the case file cannot be read again.
    pub(super) fn of(
        &self,
        case: &Case,
        maker: &Maker<'_>,
        cuts: Option<&[TrialCut]>,
    ) -> Result<Option<RescaledCase>, Error> {
        let cuts = cuts.filter(|_| self.rescale);
        cuts.map(|cuts| rescale(case, maker, cuts, 0.01 * self.chatter_error_percent))
            .transpose()
    }
}

/// Builds the stability method of a case.
type Maker<'a> = crate::stability::MethodOfCase<'a>;

/// A case with natural frequencies from check cuts, and how they were found.
pub(super) struct RescaledCase {
    /// The case as its text reads.
    pub(super) case: Case,
    /// Text of the case file, with the comments of the original.
    pub(super) text: String,
    pub(super) answer: RescalingOutput,
}

/// Factors of the natural frequencies, and the check cuts behind them.
#[derive(Serialize)]
pub(super) struct RescalingOutput {
    modes: Vec<ModeOutput>,
    cuts: Vec<CheckCut>,
}

#[derive(Serialize)]
struct ModeOutput {
    /// Number of the mode, from 1.
    mode: usize,
    /// Natural frequency before, Hz.
    before_hz: f64,
    /// Natural frequency with the factor, Hz.
    frequency_hz: f64,
    factor: f64,
    /// 90 % interval of the factor from the errors of the measured chatter frequencies.
    factor_ci90: [f64; 2],
}

/// Rescales the natural frequencies of the modes of a case that chattered in the cuts; `error` is the standard deviation of a measured
/// chatter frequency, relative to it.
///
/// # Errors
/// No cut identifies the natural frequency of a mode, or the case file cannot be read again.
fn rescale(case: &Case, maker: &Maker<'_>, cuts: &[TrialCut], error: f64) -> Result<RescaledCase, Error> {
    let found = rescaling(case, maker, cuts, error).map_err(Error::input)?;
    for cut in &found.cuts {
        warn_of_cut(case.path.as_path(), cut);
    }
    let text = text_of(&file::read_text(&case.path)?, &found)
        .map_err(|reason| Error::input(format!("{}: {reason}", case.path.display())))?;
    let rescaled = Case::parse(&case.path, &text).map_err(Error::input)?;
    let modes = found.modes.iter().map(ModeOutput::of).collect();
    Ok(RescaledCase {
        case: rescaled,
        text,
        answer: RescalingOutput {
            modes,
            cuts: found.cuts,
        },
    })
}

fn warn_of_cut(path: &Path, cut: &CheckCut) {
    let at = format!("{} rev/min, {} mm", cut.rpm, cut.depth_mm);
    if let Some(reason) = &cut.reason {
        tracing::warn!("the cut at {at} rescales no mode: {reason}");
    }
    if let Some(multiplier_abs) = cut.multiplier_abs.filter(|abs| *abs < 1.0) {
        tracing::warn!(
            "{}: with the rescaled frequency the cut at {at} is predicted stable, |Floquet multiplier| = {multiplier_abs:.3}, although it \
             chattered: damping ratio or cutting coefficients of the case are wrong too",
            path.display()
        );
    }
}

impl ModeOutput {
    fn of(mode: &RescaledMode) -> Self {
        let half = NINETY_PERCENT * mode.factor_std;
        Self {
            mode: mode.mode,
            before_hz: mode.frequency_hz,
            frequency_hz: mode.frequency_hz * mode.factor,
            factor: mode.factor,
            factor_ci90: [mode.factor - half, mode.factor + half],
        }
    }
}

/// Assumption that the written case states about one mode.
fn sentence(mode: &RescaledMode) -> String {
    let half = NINETY_PERCENT * mode.factor_std;
    let digits = |factor: f64| significant(factor, 4);
    let speeds: Vec<String> = mode.speeds_rpm.iter().map(ToString::to_string).collect();
    format!(
        "the natural frequency of mode {}, {} Hz before, is multiplied by {} (90 % interval {} to {}) at constant modal mass and damping ratio, from \
         the chatter frequency of cuts at {} rev/min; the other modes stay",
        mode.mode,
        significant(mode.frequency_hz, 6),
        digits(mode.factor),
        digits(mode.factor - half),
        digits(mode.factor + half),
        speeds.join(", ")
    )
}

/// Text of the case file with rescaled modes: frequencies multiplied and left shapes divided by the factors, with the standard
/// deviations of the frequencies from the cuts, the speed of the cuts if they have one, and a sentence under `[provenance]`.
///
/// # Errors
/// The text is not that of a case with these modes.
fn text_of(before: &str, found: &Rescaling) -> Result<String, String> {
    let mut document: DocumentMut = before.parse().map_err(|error| format!("{error}"))?;
    for mode in &found.modes {
        let missing = || format!("there is no [[structure.mode]] number {}", mode.mode);
        let has_row = scale_covariance(&mut document, mode);
        let table = mode_table(&mut document, mode.mode - 1).ok_or_else(missing)?;
        scale(table.get_mut("frequency_hz"), mode.factor);
        for key in ["left", "left_std"] {
            scale(table.get_mut(key), mode.factor.recip());
        }
        if !has_row {
            let std_hz = mode.frequency_hz * mode.factor_std;
            set(table, "frequency_hz_std", std_hz);
        }
    }
    if let Some(structure) = document.get_mut("structure").and_then(Item::as_table_like_mut) {
        let mut speeds = found.modes.iter().flat_map(|mode| &mode.speeds_rpm);
        let first = speeds.next().copied();
        match first.filter(|first| speeds.all(|rpm| rpm == first)) {
            Some(rpm) => set(structure, "rpm", rpm),
            None => {
                structure.remove("rpm");
            }
        }
    }
    let provenance = document
        .entry("provenance")
        .or_insert_with(toml_edit::table)
        .as_table_like_mut()
        .ok_or("provenance is no table")?;
    let assumed = provenance
        .entry("assumed")
        .or_insert_with(|| toml_edit::value(Array::new()))
        .as_array_mut()
        .ok_or("provenance.assumed is no array")?;
    for mode in &found.modes {
        assumed.push(sentence(mode));
    }
    Ok(document.to_string())
}

fn mode_table(document: &mut DocumentMut, index: usize) -> Option<&mut dyn TableLike> {
    let modes = document
        .get_mut("structure")?
        .as_table_like_mut()?
        .get_mut("mode")?;
    match modes {
        Item::ArrayOfTables(tables) => in_tables(tables, index),
        Item::Value(Value::Array(tables)) => tables
            .get_mut(index)?
            .as_inline_table_mut()
            .map(|table| table as &mut dyn TableLike),
        _ => None,
    }
}

fn in_tables(tables: &mut ArrayOfTables, index: usize) -> Option<&mut dyn TableLike> {
    tables.get_mut(index).map(|table| table as &mut dyn TableLike)
}

/// Multiplies a number, or all numbers of an array, by a factor; comments beside it stay.
fn scale(item: Option<&mut Item>, factor: f64) {
    if let Some(value) = item.and_then(Item::as_value_mut) {
        scale_value(value, factor);
    }
}

fn scale_value(value: &mut Value, factor: f64) {
    if let Value::Array(entries) = value {
        entries.iter_mut().for_each(|entry| scale_value(entry, factor));
        return;
    }
    if let Some(number) = number(value) {
        replace(value, number * factor);
    }
}

fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|integer| integer as f64))
}

/// Gives a key a number; comments beside a key that is there already stay.
fn set(table: &mut dyn TableLike, key: &str, number: f64) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(value) => replace(value, number),
        None => {
            table.insert(key, toml_edit::value(number));
        }
    }
}

fn replace(value: &mut Value, number: f64) {
    let decor = value.decor().clone();
    *value = Value::from(number);
    *value.decor_mut() = decor;
}

/// Gives the natural frequency of a mode in the section `[uncertainty]` the variance of its factor, independent of the other
/// parameters, and scales the rows and columns of its left shape; false if the section has no row of the frequency.
fn scale_covariance(document: &mut DocumentMut, mode: &RescaledMode) -> bool {
    let Some(section) = document.get_mut("uncertainty").and_then(Item::as_table_like_mut) else {
        return false;
    };
    let names: Vec<String> = section
        .get("parameters")
        .and_then(Item::as_array)
        .into_iter()
        .flat_map(Array::iter)
        .map(|name| name.as_str().unwrap_or_default().to_owned())
        .collect();
    let frequency = format!("structure.mode.{}.frequency_hz", mode.mode);
    let left = format!("structure.mode.{}.left.", mode.mode);
    let factor = |name: &str| {
        if name == frequency {
            0.0
        } else if name.starts_with(&left) {
            mode.factor.recip()
        } else {
            1.0
        }
    };
    let Some(rows) = section.get_mut("covariance").and_then(Item::as_array_mut) else {
        return false;
    };
    for (row, entries) in names.iter().zip(rows.iter_mut()) {
        let Some(entries) = entries.as_array_mut() else {
            continue;
        };
        for (column, entry) in names.iter().zip(entries.iter_mut()) {
            let by = factor(row) * factor(column);
            if *row == frequency && *column == frequency {
                replace(entry, (mode.frequency_hz * mode.factor_std).powi(2));
            } else if by != 1.0 {
                scale_value(entry, by);
            }
        }
    }
    names.contains(&frequency)
}

#[cfg(test)]
mod tests;
