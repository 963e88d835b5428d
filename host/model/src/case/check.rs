//! Conversion of a case file to a case, with checks of its values.

mod extensions;
mod job;
mod joints;
mod limits;
mod provenance;
mod speed_dependence;
mod structure;
mod tool;
mod uncertainty;

use std::path::Path;

use toml::Spanned;

use super::file::{CaseFile, Number};
use super::sections::Section;
use super::{Case, CaseError, Deviation, Parameter, Posture};

impl Case {
    /// Reads a case file.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, has an unknown key, lacks a required key, has a value that is not
    /// possible, or has extensions that are not possible together.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, CaseError> {
        let path = path.as_ref();
        Self::parse(path, &quietcut_recording::file::read_text(path)?)
    }

    /// A case from the text of a case file. `path` gives the default name of the case and is named in error messages.
    ///
    /// # Errors
    /// As [`Case::read`], except that no file is read.
    pub fn parse(path: &Path, text: &str) -> Result<Self, CaseError> {
        case(path, text)
    }
}

fn case(path: &Path, text: &str) -> Result<Case, CaseError> {
    let file: CaseFile = toml::from_str(text).map_err(|error| syntax(path, text, &error))?;
    let mut check = Check {
        path,
        text,
        deviations: Vec::new(),
    };
    let posture = file
        .posture
        .map_or(Ok(Posture::default()), |posture| check.posture(posture))?;
    let mut structure = None;
    let (mut structure_rpm, mut speed_dependence) = (None, None);
    if let Some(file) = &file.structure {
        let checked = check.structure(file, &posture.joints_deg)?;
        structure_rpm = check.structure_rpm(file.get_ref())?;
        speed_dependence = check.speed_dependence(file, &checked)?;
        structure = Some(checked);
    }
    let tool = file.tool.map(|tool| check.tool(&tool)).transpose()?;
    let material = file
        .material
        .map(|material| check.material(&material))
        .transpose()?;
    let cut = file.cut.map(|cut| check.cut(&cut, tool.as_ref())).transpose()?;
    let limits = file.limits.map(|limits| check.limits(&limits)).transpose()?;
    let extensions = check.extensions(file.extension)?;
    let provenance = file.provenance.unwrap_or_default();
    let zero_receptances = check.receptances(&provenance.zero_receptances)?;
    let name = file.name.unwrap_or_else(|| {
        path.file_stem()
            .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
    });
    let mut case = Case {
        path: path.into(),
        name,
        structure,
        structure_rpm,
        speed_dependence,
        tool,
        material,
        cut,
        limits,
        posture,
        deviations: std::mem::take(&mut check.deviations),
        covariance: None,
        assumed: provenance.assumed,
        zero_receptances,
        extensions,
    };
    case.covariance = file
        .uncertainty
        .map(|uncertainty| check.uncertainty(&uncertainty, &case))
        .transpose()?;
    Ok(case)
}

fn syntax(path: &Path, text: &str, error: &toml::de::Error) -> CaseError {
    let line = line_of(text, error.span().map_or(0, |span| span.start));
    let mut message = error.message().trim().replace('\n', ", ");
    if message.starts_with("missing field")
        && let Some(lacks) = Section::at(text, line).and_then(|section| section.lacks(text))
    {
        message = lacks;
    }
    CaseError::Syntax {
        path: path.into(),
        line,
        source_line: text.lines().nth(line - 1).unwrap_or("").trim().into(),
        message,
    }
}

/// Number of the line, from 1, that contains the byte at `offset` of the text.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

struct Check<'a> {
    path: &'a Path,
    text: &'a str,
    deviations: Vec<Deviation>,
}

impl Check<'_> {
    fn wrong<T>(
        &self,
        at: &Spanned<T>,
        key: &str,
        found: impl ToString,
        expected: impl Into<String>,
    ) -> CaseError {
        CaseError::Value {
            path: self.path.into(),
            line: self.line(at),
            key: key.into(),
            found: found.to_string(),
            expected: expected.into(),
        }
    }

    fn line<T>(&self, at: &Spanned<T>) -> usize {
        line_of(self.text, at.span().start)
    }

    fn number(
        &self,
        value: &Number,
        key: &str,
        allowed: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<f64, CaseError> {
        let number = *value.get_ref();
        if number.is_finite() && allowed(number) {
            Ok(number)
        } else {
            Err(self.wrong(value, key, number, expected))
        }
    }

    fn positive(&self, value: &Number, key: &str) -> Result<f64, CaseError> {
        self.number(value, key, |x| x > 0.0, "a number greater than 0")
    }

    /// A number within `[low, high]`, in `unit`. The error of a finite number of larger magnitude than `high` suggests
    /// the number divided by `factor`, in case it was meant in the unit `smaller`.
    fn sized(
        &self,
        value: &Number,
        key: &str,
        [low, high]: [f64; 2],
        (unit, factor, smaller): (&str, f64, &str),
    ) -> Result<f64, CaseError> {
        let number = *value.get_ref();
        let within = format!("a number from {low} to {high} ({unit})");
        let expected = if number.is_finite() && number.abs() > high {
            format!(
                "{within}, such as {} if the value was in {smaller},",
                number / factor
            )
        } else {
            within
        };
        self.number(value, key, |x| (low..=high).contains(&x), &expected)
    }

    fn finite(&self, value: &Number, key: &str) -> Result<f64, CaseError> {
        self.number(value, key, |_| true, "a finite number")
    }

    fn finite_or(&self, value: &Option<Number>, key: &str, default: f64) -> Result<f64, CaseError> {
        value
            .as_ref()
            .map_or(Ok(default), |value| self.finite(value, key))
    }

    fn deviation(
        &mut self,
        value: &Option<Number>,
        key: &str,
        parameter: Parameter,
    ) -> Result<(), CaseError> {
        let Some(value) = value else { return Ok(()) };
        let key = format!("{key}_std");
        let std = self.number(value, &key, |x| x >= 0.0, "a standard deviation of 0 or more")?;
        self.push_deviation(parameter, std);
        Ok(())
    }

    fn push_deviation(&mut self, parameter: Parameter, std: f64) {
        if std > 0.0 {
            self.deviations.push(Deviation { parameter, std });
        }
    }
}
