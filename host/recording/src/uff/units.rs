//! Units of a UFF file: data set 164 for the whole file; unit label and specific data type for each axis.

use super::header::Axis;
use super::number;
use crate::{Quantity, Unit, UnknownUnit};

/// Units of a UFF file (data set 164), as conversion factors: value in SI units = value in the file / factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileUnits {
    /// Units of length per metre.
    pub(crate) length: f64,
    /// Units of force per newton.
    pub(crate) force: f64,
}

impl FileUnits {
    /// SI units: metre and newton.
    pub(crate) const SI: Self = Self {
        length: 1.0,
        force: 1.0,
    };

    /// Parses the lines of a UFF data set 164 (units): its conversion factors, or else its units code.
    ///
    /// # Errors
    /// Index of the faulty line, from 0, and a description of the fault.
    pub(super) fn parse(lines: &[String]) -> Result<Self, (usize, String)> {
        let mut factors = Vec::new();
        for (index, line) in lines.iter().enumerate().skip(1) {
            number::append(line.as_bytes(), &mut factors).map_err(|what| (index, what))?;
        }
        if let &[length, force, ..] = factors.as_slice() {
            let is_possible = |factor: f64| factor.is_finite() && factor > 0.0;
            return if is_possible(length) && is_possible(force) {
                Ok(Self { length, force })
            } else {
                Err((
                    1,
                    format!("factors of length and force {length} and {force}; they must be greater than 0"),
                ))
            };
        }
        let code = lines
            .first()
            .and_then(|line| line.split_whitespace().next())
            .unwrap_or_default();
        let (length, force) = match code {
            "1" => (1.0, 1.0),
            "2" => (FEET, POUNDS),
            "3" => (1.0, KILOGRAMS),
            "5" => (1e3, 1e3),
            "6" => (1e2, 1e2),
            "7" => (12.0 * FEET, POUNDS),
            "8" => (1e3, KILOGRAMS),
            "10" => (1e3, 1.0),
            other => {
                return Err((
                    0,
                    format!(
                        "units code \"{other}\" without conversion factors; a line with the factors is needed"
                    ),
                ));
            }
        };
        Ok(Self { length, force })
    }
}

/// Feet per metre (1 ft = 0.3048 m exactly).
const FEET: f64 = 1.0 / 0.3048;
/// Pounds-force per newton (1 lbf = 4.448 221 615 260 5 N exactly).
const POUNDS: f64 = 1.0 / 4.448_221_615_260_5;
/// Kilograms-force per newton (1 kgf = 9.806 65 N exactly).
const KILOGRAMS: f64 = 1.0 / 9.806_65;

/// Quantity that a UFF specific data type stands for; `None` for types that are not supported.
fn quantity(kind: i64) -> Option<Quantity> {
    Some(match kind {
        8 => Quantity::Displacement,
        9 | 13 => Quantity::Force,
        11 => Quantity::Velocity,
        12 => Quantity::Acceleration,
        15 | 21 => Quantity::Pressure,
        17 => Quantity::Time,
        _ => return None,
    })
}

/// UFF specific data type that is written for a quantity.
pub(super) fn kind(quantity: Quantity) -> i64 {
    match quantity {
        Quantity::Displacement => 8,
        Quantity::Velocity => 11,
        Quantity::Acceleration => 12,
        Quantity::Force => 13,
        Quantity::Pressure => 15,
        Quantity::Time => 17,
        Quantity::Angle | Quantity::Voltage | Quantity::Level => 1,
        Quantity::Unknown => 0,
    }
}

/// Unit of an axis of a UFF function; `None` if the file states no unit that is supported.
///
/// The unit label of the axis takes precedence over the units of the file.
///
/// # Errors
/// The label is unknown although the specific data type is a supported quantity, or it contradicts the specific data
/// type. A label of voltage contradicts no type.
pub fn unit(axis: &Axis, file: FileUnits) -> Result<Option<Unit>, String> {
    let stated = quantity(axis.kind);
    if axis.unit.is_empty() {
        return Ok(stated.map(|quantity| Unit {
            quantity,
            factor: factor(axis, quantity, file),
        }));
    }
    match (label(&axis.unit), stated) {
        (Ok(unit), Some(stated)) if unit.quantity != stated && unit.quantity != Quantity::Voltage => {
            Err(format!(
                "unit \"{}\" is of {}, but the specific data type {} is {stated}",
                axis.unit, unit.quantity, axis.kind
            ))
        }
        (Ok(unit), _) => Ok(Some(unit)),
        (Err(error), Some(_)) => Err(error.to_string()),
        // The unit label is unknown, but the specific data type is not a supported quantity either, so the axis has no
        // unit.
        (Err(_), None) => Ok(None),
    }
}

/// Factor that converts an axis of quantity `quantity` to SI, from the units of the UFF file and the exponents of
/// length and force of the axis.
fn factor(axis: &Axis, quantity: Quantity, file: FileUnits) -> f64 {
    let usual = match quantity {
        Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration => [1, 0],
        Quantity::Force => [0, 1],
        Quantity::Pressure => [-2, 1],
        _ => [0, 0],
    };
    // Many writers leave the exponents of length and force at 0; then the exponents of the quantity apply.
    let [length, force] = if axis.exponents == [0, 0] {
        usual
    } else {
        axis.exponents
    };
    let power = |base: f64, exponent: i64| base.powi(exponent.clamp(-9, 9) as i32);
    1.0 / (power(file.length, length) * power(file.force, force))
}

/// Parses the unit label of a UFF axis, also in capitals and with `sec` for s.
fn label(text: &str) -> Result<Unit, UnknownUnit> {
    let exact = text.parse::<Unit>();
    if exact.is_ok() {
        return exact;
    }
    let plain = text
        .to_lowercase()
        .replace("sec", "s")
        .replace([' ', '(', ')'], "");
    let plain = match plain.as_str() {
        "n" | "newton" | "newtons" => "N",
        "kn" => "kN",
        "m/s/s" => "m/s^2",
        "mm/s/s" => "mm/s^2",
        "pa" => "Pa",
        "v" | "volt" | "volts" => "V",
        "mv" => "mV",
        "seconds" => "s",
        other => other,
    };
    plain.parse().map_err(|_| UnknownUnit { found: text.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(kind: i64, unit: &str) -> Axis {
        Axis {
            kind,
            exponents: [0, 0],
            unit: unit.into(),
        }
    }

    #[test]
    fn labels_take_precedence_over_the_units_of_the_file() {
        let millimetres = FileUnits {
            length: 1e3,
            force: 1e3,
        };
        let factor = |kind, label| unit(&axis(kind, label), millimetres).unwrap().unwrap().factor;
        assert_eq!(factor(12, "g"), 9.806_65);
        assert_eq!(factor(12, "M/SEC^2"), 1.0);
        assert_eq!(factor(12, ""), 1e-3);
        assert_eq!(factor(13, ""), 1e-3);
        assert_eq!(factor(13, "KN"), 1e3);
        assert_eq!(unit(&axis(0, ""), millimetres).unwrap(), None);
        assert_eq!(unit(&axis(5, "degC"), millimetres).unwrap(), None);
        assert!(
            unit(&axis(12, "N"), millimetres)
                .unwrap_err()
                .contains("acceleration")
        );
        assert!(
            unit(&axis(12, "furlong"), millimetres)
                .unwrap_err()
                .contains("furlong")
        );
    }

    #[test]
    fn factors_and_codes_agree() {
        let lines = |text: &str| text.lines().map(String::from).collect::<Vec<_>>();
        let units = FileUnits::parse(&lines(
            "7  Inch (pound f)   2\n 3.937007874015748D+01 2.248089430997105E-01 1.8\n459.67",
        ));
        let by_code = FileUnits::parse(&lines("7")).unwrap();
        let units = units.unwrap();
        // The factors have 16 digits.
        assert!((units.length / by_code.length - 1.0).abs() < 1e-14);
        assert!((units.force / by_code.force - 1.0).abs() < 1e-14);
        for wrong in ["9", "", "1\n0.0 1.0", "1\n1.0 -1.0", "1\nx"] {
            assert!(FileUnits::parse(&lines(wrong)).is_err(), "{wrong}");
        }
    }
}
