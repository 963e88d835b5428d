//! FRF tables in CSV files: `frequency_hz,hxx_re [m/N],hxx_im [m/N],hxy_re [m/N],…`, optional `coherence_xx` and
//! `folding_xx`, the relative error by aliasing.

use std::path::Path;

use num_complex::Complex64;

use super::frf_unit::{DirectionPair, FrfUnit, frf_unit, pair_of};
use super::{Frf, FrfError, FrfTable, ImportedTable};
use quietcut_recording::{Format, Import, TextTable};

/// Content of a column of an FRF table, from its header.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ColumnContent {
    Frequency,
    Receptance {
        pair: DirectionPair,
        part: ComplexPart,
        unit: FrfUnit,
    },
    Coherence(DirectionPair),
    Folding(DirectionPair),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ComplexPart {
    Real,
    Imaginary,
}

struct Column {
    title: String,
    content: ColumnContent,
    values: Vec<f64>,
}

impl FrfTable {
    /// Reads an FRF table from a text file, or from UFF 58 with the extension uff, unv or bunv.
    ///
    /// Units: displacement, velocity or acceleration per force, such as um/N or g/N. Mobility and accelerance are
    /// converted to receptance. In a table with the column `frequency_hz`, the header of a receptance without unit
    /// means m/N, and lines that begin with # are comments.
    ///
    /// # Errors
    /// For example: the file cannot be read; a column has an unknown name or unit, or lacks its real or imaginary part;
    /// a value is not a number; the frequencies do not ascend.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FrfError> {
        Self::import(path, &Import::default()).map(|imported| imported.table)
    }

    /// Reads an FRF table with what the user states about its columns; for a text table of another program, the result
    /// also describes the meaning found for the columns.
    ///
    /// Text tables of other programs have real and imaginary part, or magnitude (also in dB) and phase.
    ///
    /// # Errors
    /// As [`FrfTable::read`]; also if directions or units are not stated, where the message names the option that
    /// states them; and if `import` names columns of a file that states them itself, or a column that is not there.
    pub fn import(path: impl AsRef<Path>, import: &Import) -> Result<ImportedTable, FrfError> {
        let path = path.as_ref();
        if Format::of(path)? == Format::Uff {
            return super::table_uff::read(path, import);
        }
        let is_own = Format::of(path)? == Format::Text
            && TextTable::titles(path)?
                .iter()
                .any(|title| title == "frequency_hz" || title == "frequency_hz [Hz]");
        if !is_own {
            return super::table_found::read(path, import);
        }
        let table = Self::parse(path, &quietcut_recording::file::read_text(path)?)?;
        if let Some(map) = import.map.first() {
            return Err(FrfError::Content {
                path: path.into(),
                what: format!(
                    "--map {}: the file states names and units of its columns itself; omit --map",
                    map.column
                ),
            });
        }
        Ok(ImportedTable {
            table,
            understood: None,
        })
    }

    /// True if a file is an FRF table and not a recording over time: a text file by its column titles, a UFF file if it
    /// has a frequency response function, a MAT-file by the names of its variables; any if `import` names
    /// a column `frequency_hz`. Other files count as none.
    ///
    /// # Errors
    /// A text file cannot be read; a UFF file that cannot be read counts as no table.
    pub fn is_table(path: &Path, import: &Import) -> Result<bool, FrfError> {
        if import.map.iter().any(|map| map.name == "frequency_hz") {
            return Ok(true);
        }
        match Format::of(path) {
            Ok(Format::Uff) => Ok(super::table_uff::has_frf(path)),
            Ok(Format::Text) => Ok(super::table_column::is_head(&TextTable::titles(path)?)),
            Ok(Format::Mat) => {
                Ok(TextTable::titles(path).is_ok_and(|titles| super::table_column::is_head(&titles)))
            }
            _ => Ok(false),
        }
    }

    /// Parses a table from text in the CSV format of this program; `path` is used in messages.
    ///
    /// # Errors
    /// As [`FrfTable::read`] of a file with this text.
    pub fn parse(path: &Path, text: &str) -> Result<Self, FrfError> {
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| malformed(path, &error))?.clone();
        let mut columns = header
            .iter()
            .map(|title| column(path, title))
            .collect::<Result<Vec<_>, _>>()?;
        let mut record = csv::StringRecord::new();
        while reader
            .read_record(&mut record)
            .map_err(|error| malformed(path, &error))?
        {
            push_line(path, &mut columns, &record)?;
        }
        assemble(path, columns)
    }

    /// Writes the table to `path` as CSV, atomically: on an error the previous file stays unchanged.
    ///
    /// Numbers are written with all digits, so that the file gives the same frequencies, receptances, coherences and errors by
    /// aliasing.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), FrfError> {
        quietcut_recording::file::write_with(path, |writer| {
            let mut writer = csv::Writer::from_writer(writer);
            let mut titles = vec!["frequency_hz".to_owned()];
            for entry in self.entries() {
                let name = entry.name();
                titles.push(format!("h{name}_re [m/N]"));
                titles.push(format!("h{name}_im [m/N]"));
                if entry.coherence.is_some() {
                    titles.push(format!("coherence_{name}"));
                }
                if entry.folding.is_some() {
                    titles.push(format!("folding_{name}"));
                }
            }
            writer.write_record(&titles)?;
            for (index, frequency_hz) in self.frequency_hz().iter().enumerate() {
                let mut row = vec![frequency_hz.to_string()];
                for entry in self.entries() {
                    let value = entry.receptance[index];
                    row.push(format!("{:e}", value.re));
                    row.push(format!("{:e}", value.im));
                    let further = entry.coherence.iter().chain(&entry.folding);
                    row.extend(further.map(|values| values[index].to_string()));
                }
                writer.write_record(&row)?;
            }
            writer.flush()
        })?;
        Ok(())
    }
}

fn malformed(path: &Path, error: &csv::Error) -> FrfError {
    FrfError::Line {
        path: path.into(),
        line: error.position().map_or(1, csv::Position::line),
        what: error.to_string(),
    }
}

fn column(path: &Path, title: &str) -> Result<Column, FrfError> {
    let wrong = |what: String| FrfError::Column {
        path: path.into(),
        column: title.into(),
        what,
    };
    let (name, unit) = match title.strip_suffix(']').and_then(|inner| inner.split_once('[')) {
        Some((name, unit)) => (name.trim(), Some(unit.trim())),
        None => (title, None),
    };
    let part = |name: &str| {
        let (pair, part) = name.strip_prefix('h')?.split_once('_')?;
        let part = match part {
            "re" => ComplexPart::Real,
            "im" => ComplexPart::Imaginary,
            _ => return None,
        };
        Some((pair_of(pair)?, part))
    };
    let content = if name == "frequency_hz" && unit.is_none_or(|unit| unit == "Hz") {
        ColumnContent::Frequency
    } else if let Some((pair, part)) = part(name) {
        ColumnContent::Receptance {
            pair,
            part,
            unit: unit.map_or(Ok(FrfUnit::SI), frf_unit).map_err(wrong)?,
        }
    } else if let Some(pair) = name.strip_prefix("coherence_").and_then(pair_of)
        && unit.is_none_or(|unit| unit == "1")
    {
        ColumnContent::Coherence(pair)
    } else if let Some(pair) = name.strip_prefix("folding_").and_then(pair_of)
        && unit.is_none_or(|unit| unit == "1")
    {
        ColumnContent::Folding(pair)
    } else {
        return Err(wrong(
            "no column of a table of frequency response functions; frequency_hz, hxy_re [m/N], hxy_im [m/N] and \
             coherence_xy with x, y or z in both places are"
                .into(),
        ));
    };
    Ok(Column {
        title: title.into(),
        content,
        values: Vec::new(),
    })
}

fn push_line(path: &Path, columns: &mut [Column], record: &csv::StringRecord) -> Result<(), FrfError> {
    let line = record.position().map_or(0, csv::Position::line);
    let wrong = |what: String| FrfError::Line {
        path: path.into(),
        line,
        what,
    };
    if record.len() != columns.len() {
        return Err(wrong(format!(
            "{} values, but the header has {} columns",
            record.len(),
            columns.len()
        )));
    }
    for (column, field) in columns.iter_mut().zip(record) {
        let (title, previous) = (&column.title, column.values.last().copied());
        let needed = |what: &str| wrong(format!("\"{field}\" in column \"{title}\": {what} is needed"));
        let value = match field.parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            _ => return Err(needed("a number")),
        };
        match column.content {
            ColumnContent::Frequency if value < 0.0 => return Err(needed("a frequency of 0 or more")),
            ColumnContent::Frequency if previous.is_some_and(|previous| previous >= value) => {
                return Err(needed("a frequency above that of the line before"));
            }
            ColumnContent::Coherence(_) if !(0.0..=1.0).contains(&value) => {
                return Err(needed("a number from 0 to 1"));
            }
            _ => column.values.push(value),
        }
    }
    Ok(())
}

fn assemble(path: &Path, columns: Vec<Column>) -> Result<FrfTable, FrfError> {
    let lacks = |what: String| FrfError::Content {
        path: path.into(),
        what,
    };
    for (index, column) in columns.iter().enumerate() {
        let same = |other: &Column| match (column.content, other.content) {
            (
                ColumnContent::Receptance { pair, part, .. },
                ColumnContent::Receptance {
                    pair: others,
                    part: other,
                    ..
                },
            ) => pair == others && part == other,
            (one, other) => one == other,
        };
        if columns[..index].iter().any(same) {
            return Err(lacks(format!("column \"{}\" is there twice", column.title)));
        }
    }
    let frequency_hz = columns
        .iter()
        .find(|column| column.content == ColumnContent::Frequency)
        .ok_or_else(|| lacks("there is no column frequency_hz".into()))?
        .values
        .clone();
    let mut entries: Vec<Frf> = Vec::new();
    for column in &columns {
        let ColumnContent::Receptance { pair, part, unit } = column.content else {
            continue;
        };
        let other = columns.iter().find_map(|other| match other.content {
            ColumnContent::Receptance {
                pair: others,
                part: other_part,
                unit,
            } if others == pair && other_part != part => Some((&other.values, unit)),
            _ => None,
        });
        let Some((other, other_unit)) = other else {
            return Err(lacks(format!(
                "column \"{}\" stands alone; real and imaginary part are needed",
                column.title
            )));
        };
        // Real and imaginary column form one receptance; it is created at the real column, and the imaginary column is
        // skipped.
        if part == ComplexPart::Imaginary {
            continue;
        }
        if unit != other_unit {
            return Err(lacks(format!(
                "column \"{}\" and its imaginary part have different units",
                column.title
            )));
        }
        let receptance = frequency_hz
            .iter()
            .zip(column.values.iter().zip(other))
            .map(|(&f, (&re, &im))| {
                unit.receptance(Complex64::new(re, im), f).ok_or_else(|| {
                    lacks(format!(
                        "column \"{}\" cannot be turned into a receptance at {f} Hz; leave out that line",
                        column.title
                    ))
                })
            })
            .collect::<Result<_, _>>()?;
        entries.push(Frf {
            response: pair.0,
            force: pair.1,
            receptance,
            coherence: values_of(&columns, ColumnContent::Coherence(pair)),
            folding: values_of(&columns, ColumnContent::Folding(pair)),
        });
    }
    if let Some(orphan) = columns.iter().find(
        |column| matches!(column.content, ColumnContent::Coherence(pair) | ColumnContent::Folding(pair) if !entries.iter().any(|e| (e.response, e.force) == pair)),
    ) {
        return Err(lacks(format!(
            "column \"{}\" has no receptance it belongs to",
            orphan.title
        )));
    }
    FrfTable::new(path, frequency_hz, entries)
}

fn values_of(columns: &[Column], content: ColumnContent) -> Option<Vec<f64>> {
    columns
        .iter()
        .find(|column| column.content == content)
        .map(|column| column.values.clone())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn parse(text: &str) -> Result<FrfTable, FrfError> {
        FrfTable::parse(Path::new("a.csv"), text)
    }

    #[test]
    fn units_become_si() {
        let table = parse(
            "# from a tap test\nfrequency_hz,hxx_re [um/N],hxx_im [um/N],hyx_re [m/s^2/N],hyx_im [m/s^2/N],coherence_xx\n\
             10,1,-2,3,4,0.9\n20,2,-3,4,5,1\n",
        )
        .unwrap();
        assert_eq!(table.frequency_hz(), [10.0, 20.0]);
        let h = table.line(0).unwrap();
        assert!((h[(0, 0)] - Complex64::new(1e-6, -2e-6)).norm() < 1e-20);
        let accelerance = -h[(1, 0)] * (TAU * 10.0).powi(2);
        assert!((accelerance - Complex64::new(3.0, 4.0)).norm() < 1e-13);
        assert_eq!(table.entries()[0].coherence, Some(vec![0.9, 1.0]));
        assert_eq!(table.entries()[1].coherence, None);
    }

    #[test]
    fn what_is_written_is_read_back() {
        let table = parse(
            "frequency_hz,hxx_re [m/N],hxx_im [m/N],coherence_xx,hzy_re,hzy_im\n0.1,1.25e-7,-0.333e-9,0.5,1,2\n\
             7,1e-300,4.940656e-10,1,-0.1,0.30000000000000004\n",
        )
        .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frf.csv");
        table.write(&path).unwrap();
        let again = FrfTable::read(&path).unwrap();
        assert_eq!(again.entries(), table.entries());
        assert_eq!(again.frequency_hz(), table.frequency_hz());
    }

    #[test]
    fn wrong_tables_are_refused_with_file_line_and_value() {
        let refused = |text: &str, said: &[&str]| {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains("a.csv"), "{error}");
            for said in said {
                assert!(error.contains(said), "{error}: {said}");
            }
        };
        let header = "frequency_hz,hxx_re [m/N],hxx_im [m/N]\n";
        refused(
            &format!("{header}1,2,x\n"),
            &["line 2", "\"x\"", "hxx_im", "number"],
        );
        refused(&format!("{header}2,1,1\n1,1,1\n"), &["line 3", "\"1\"", "above"]);
        refused(&format!("{header}-2,1,1\n"), &["line 2", "-2"]);
        refused(&format!("{header}1,2\n"), &["line 2", "3 columns"]);
        refused(header, &["nothing"]);
        refused("frequency_hz,hxx_re [m/N]\n1,2\n", &["hxx_re", "imaginary"]);
        refused("hxx_re [m/N],hxx_im [m/N]\n1,2\n", &["frequency_hz"]);
        refused(
            "frequency_hz,hxx_re [N/m],hxx_im [N/m]\n1,2,3\n",
            &["hxx_re", "N/m"],
        );
        refused("frequency_hz,hxx_re [um/N],hxx_im [m/N]\n1,2,3\n", &["units"]);
        refused("frequency_hz,hxr_re,hxr_im\n1,2,3\n", &["hxr_re"]);
        refused("frequency_hz,hxx_re,hxx_re,hxx_im\n1,2,3,4\n", &["twice"]);
        refused(
            "frequency_hz,hxx_re,hxx_im,coherence_xx\n1,2,3,1.5\n",
            &["line 2", "1.5"],
        );
        refused(
            "frequency_hz,hxx_re,hxx_im,coherence_xy\n1,2,3,1\n",
            &["coherence_xy"],
        );
        refused("frequency_hz,hxx_re [g/N],hxx_im [g/N]\n0,2,3\n", &["0 Hz"]);
    }
}
