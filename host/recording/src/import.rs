//! Options of an import: what the user states about a file on the command line.

use super::Quantity;
use super::segment::Segment;
use super::unit::{Sensitivity, Unit};

/// Facts that the user states on the command line about the files of a command; they take precedence over the files and
/// their sidecars.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// Segment of the recording that is read, by start and end time.
    pub segment: Segment,
    /// Facts that the user states about columns with the option `--map`; of several about one column the first counts.
    pub map: Vec<ColumnMap>,
    /// Sample rate, samples per second (`--rate`); it replaces the time column of the file and every rate that file or
    /// sidecar state. `None` if the user states none.
    pub rate_hz: Option<f64>,
    /// Number of the one record to read from a file with several records, from 1 (`--record`); `None` for all.
    pub record: Option<usize>,
}

/// Channel name, point and unit that the user states for one column, as in `acc=ax:g` or `acc=ax@3:g`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMap {
    /// Name of the column in the file, or its number in the file from 1.
    pub column: String,
    /// Name of the channel that the column becomes; any other name than those of force, motion, time and tachometer
    /// makes it an auxiliary channel.
    pub name: String,
    /// Name of the point of the sensor (`acc=ax@3`); `None` if the user states none.
    pub point: Option<String>,
    /// True if the channel points against its axis (`acc=-ax`): samples change their sign.
    pub is_negative: bool,
    /// Unit of the samples in the column, or sensitivity of its sensor; `None` if the user states nothing about them.
    pub scale: Option<Scale>,
}

/// The facts about columns that one option `--map` states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnMaps(pub Vec<ColumnMap>);

/// Unit of the samples of a column, sensitivity of the sensor that gave them, or unit of a frequency response function.
#[derive(Clone, Debug, PartialEq)]
pub enum Scale {
    /// Unit of the samples, which may have a factor: `g`, `98.1 m/s^2`.
    Unit(Unit),
    /// Sensitivity of the sensor, for samples in volts: `10.2 mV/g`.
    Sensitivity(Sensitivity),
    /// Unit of a frequency response function, response per force or decibels: `um/N`, `(m/s^2)/N`, `1/kg`, `dB`.
    Ratio(String),
}

impl ColumnMap {
    /// Parses the text of the option `--map` for one or more columns, with commas between, each as for
    /// [`ColumnMap::parse`]. A comma before which no channel is stated belongs to the name of a column: `Input 1,
    /// Hammer=fx`.
    ///
    /// # Errors
    /// As [`ColumnMap::parse`].
    pub fn parse_list(text: &str) -> Result<ColumnMaps, String> {
        let mut maps = Vec::new();
        let mut begun = String::new();
        for part in text.split(',') {
            begun = if begun.is_empty() {
                part.to_owned()
            } else {
                format!("{begun},{part}")
            };
            if part.contains('=') {
                maps.push(Self::parse(&begun)?);
                begun.clear();
            }
        }
        if !begun.is_empty() || maps.is_empty() {
            maps.push(Self::parse(&begun)?);
        }
        Ok(ColumnMaps(maps))
    }

    /// Parses the text of the option `--map` for one column, `COLUMN=NAME` or `COLUMN=NAME:UNIT`, with `@POINT` after the
    /// name for a sensor at a named point, such as `acc=ax:g`, `2=fx@5:N`, `acc=-az`, `ch1=ax:10.2 mV/g`.
    ///
    /// # Errors
    /// The text has another form, or the unit is unknown; the message states what is needed.
    pub fn parse(text: &str) -> Result<Self, String> {
        let forms =
            "COLUMN=NAME or COLUMN=NAME:UNIT is needed, such as acc=ax:g, 2=fx:N or \"ch1=ax:10.2 mV/g\"";
        // The name of a column in the file may itself contain an equals sign; the text after the last one is taken as
        // channel.
        let (column, channel) = text
            .rsplit_once('=')
            .ok_or_else(|| format!("`{text}`: {forms}"))?;
        let (name, unit) = match channel.split_once(':') {
            Some((name, unit)) => (name.trim(), Some(unit.trim())),
            None => (channel.trim(), None),
        };
        let (is_negative, name) = match name.strip_prefix('-') {
            Some(name) => (true, name),
            None => (false, name),
        };
        let (name, point) = match name.split_once('@') {
            Some((name, point)) => (name.trim(), Some(point.trim().to_owned())),
            None => (name, None),
        };
        if column.trim().is_empty() || name.is_empty() || point.as_deref() == Some("") {
            return Err(format!("`{text}`: {forms}"));
        }
        let scale = match unit {
            None => None,
            Some(unit) => Some(match (unit.parse::<Unit>(), unit.parse::<Sensitivity>()) {
                (Ok(unit), _) => Scale::Unit(unit),
                (Err(_), Ok(sensitivity)) => Scale::Sensitivity(sensitivity),
                (Err(_), Err(_)) if is_ratio(unit) => Scale::Ratio(unit.into()),
                (Err(error), Err(_)) => {
                    return Err(format!(
                        "`{text}`: {error}; a sensitivity such as 10.2 mV/g is possible too"
                    ));
                }
            }),
        };
        Ok(Self {
            column: column.trim().into(),
            name: name.into(),
            point,
            is_negative,
            scale,
        })
    }

    /// True if this option is about the column called `name`. If the option names a column of `names` exactly, it is
    /// about that column only; otherwise about the column with the number `number` (from 1) or with the same name in
    /// other capitals.
    pub fn is_about(&self, name: &str, number: usize, names: &[String]) -> bool {
        if names.contains(&self.column) {
            return self.column == name;
        }
        if self.column.parse() == Ok(number) {
            return true;
        }
        self.column.to_lowercase() == name.to_lowercase()
    }
}

/// True if the text is a unit of a frequency response function: a ratio of two units such as `um/N`, or `1/kg` or `dB`.
pub(super) fn is_ratio(text: &str) -> bool {
    let of_force = text.rsplit_once('/').is_some_and(|(response, force)| {
        let is_unit = |text: &str| {
            text.parse::<Unit>()
                .is_ok_and(|unit| unit.quantity != Quantity::Level)
        };
        is_unit(response) && is_unit(force)
    });
    let of_force_and_time = ["(N·s)", "(N*s)", "(N s)", "(Ns)", "Ns", "N/s"]
        .iter()
        .any(|ending| text.ends_with(ending) && text.contains('/'));
    of_force || of_force_and_time || ["1/kg", "s/kg"].contains(&text) || text.eq_ignore_ascii_case("db")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_mapped_by_name_or_number_with_unit_or_sensitivity() {
        let map = ColumnMap::parse("Acc X=-ax:g").unwrap();
        assert_eq!(
            (map.column.as_str(), map.name.as_str(), map.is_negative),
            ("Acc X", "ax", true)
        );
        assert!(matches!(map.scale, Some(Scale::Unit(_))));
        assert_eq!(map.point, None);
        let at_point = ColumnMap::parse("acc=-ax@left rib:g").unwrap();
        assert_eq!(
            (at_point.name.as_str(), at_point.point.as_deref()),
            ("ax", Some("left rib"))
        );
        assert!(at_point.is_negative && matches!(at_point.scale, Some(Scale::Unit(_))));
        assert!(matches!(
            ColumnMap::parse("ch1=ax:10.2mV/g").unwrap().scale,
            Some(Scale::Sensitivity(_))
        ));
        assert_eq!(ColumnMap::parse("2=fx").unwrap().scale, None);
        for wrong in ["acc", "=ax", "acc=", "acc=ax:furlong", "acc=ax@", "acc=@3"] {
            assert!(ColumnMap::parse(wrong).is_err(), "{wrong}");
        }
        let list = ColumnMap::parse_list("Input 1, Hammer=fx:N,3=ax:m/s^2").unwrap();
        let columns: Vec<&str> = list.0.iter().map(|map| map.column.as_str()).collect();
        assert_eq!(columns, ["Input 1, Hammer", "3"]);
        assert!(ColumnMap::parse_list("3=ax,acc").is_err() && ColumnMap::parse_list("").is_err());
        let names = ["acc".to_owned(), "2".to_owned()];
        let two = ColumnMap::parse("2=fx").unwrap();
        assert!(two.is_about("2", 2, &names) && !two.is_about("acc", 2, &names));
        let one = ColumnMap::parse("1=fx").unwrap();
        assert!(one.is_about("acc", 1, &names));
    }
}
