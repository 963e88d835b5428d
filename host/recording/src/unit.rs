//! Units in column headers, and the physical quantity of each unit.

use std::fmt;
use std::str::FromStr;

/// Standard gravity, m/s² (ISO 80000-3); converts `g` and kilogram-force.
const G: f64 = 9.806_65;

/// Physical quantity that a channel measures. The samples of the channel are in its SI unit, unless it is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Time, s.
    Time,
    /// Force, N.
    Force,
    /// Displacement, m.
    Displacement,
    /// Velocity, m/s.
    Velocity,
    /// Acceleration, m/s².
    Acceleration,
    /// Angle, rad.
    Angle,
    /// Pressure, Pa.
    Pressure,
    /// Voltage of a sensor, V; the sensitivity of the channel converts it to the measured quantity.
    Voltage,
    /// Dimensionless number, such as the level of a tachometer signal.
    Level,
    /// Unknown quantity, for example because neither the file nor the user states a unit.
    Unknown,
}

impl Quantity {
    /// Text of the SI unit of a quantity, as it stands in column headers; `unknown` for an unknown quantity.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Force => "N",
            Self::Displacement => "m",
            Self::Velocity => "m/s",
            Self::Acceleration => "m/s^2",
            Self::Angle => "rad",
            Self::Pressure => "Pa",
            Self::Voltage => "V",
            Self::Level => "1",
            Self::Unknown => "unknown",
        }
    }

    /// Quantity that a standard channel name stands for (`t`; `fx`; `x`; `vx`; `ax`, and the same for y and z); `None`
    /// for other names.
    pub fn of_name(name: &str) -> Option<Self> {
        match name {
            "t" => Some(Self::Time),
            "fx" | "fy" | "fz" => Some(Self::Force),
            "x" | "y" | "z" => Some(Self::Displacement),
            "vx" | "vy" | "vz" => Some(Self::Velocity),
            "ax" | "ay" | "az" => Some(Self::Acceleration),
            _ => None,
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Time => "time",
            Self::Force => "force",
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Angle => "angle",
            Self::Pressure => "pressure",
            Self::Voltage => "voltage",
            Self::Level => "a number",
            Self::Unknown => "an unknown quantity",
        })
    }
}

/// A unit: its quantity and its conversion factor to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Quantity that the unit measures.
    pub quantity: Quantity,
    /// Conversion factor of the unit: value in SI units = `factor` · value in this unit.
    pub factor: f64,
}

/// Standard spellings of all units that can be read: name, quantity, factor to SI. The first unit of each quantity is
/// the SI unit.
const UNITS: &[(&str, Quantity, f64)] = &[
    ("s", Quantity::Time, 1.0),
    ("ms", Quantity::Time, 1e-3),
    ("us", Quantity::Time, 1e-6),
    ("ns", Quantity::Time, 1e-9),
    ("min", Quantity::Time, 60.0),
    ("N", Quantity::Force, 1.0),
    ("kN", Quantity::Force, 1e3),
    ("mN", Quantity::Force, 1e-3),
    ("lbf", Quantity::Force, 4.448_221_615_260_5),
    ("kgf", Quantity::Force, G),
    ("m", Quantity::Displacement, 1.0),
    ("mm", Quantity::Displacement, 1e-3),
    ("um", Quantity::Displacement, 1e-6),
    ("nm", Quantity::Displacement, 1e-9),
    ("cm", Quantity::Displacement, 1e-2),
    ("in", Quantity::Displacement, 0.0254),
    ("mil", Quantity::Displacement, 25.4e-6),
    ("ft", Quantity::Displacement, 0.3048),
    ("m/s", Quantity::Velocity, 1.0),
    ("mm/s", Quantity::Velocity, 1e-3),
    ("um/s", Quantity::Velocity, 1e-6),
    ("in/s", Quantity::Velocity, 0.0254),
    ("ft/s", Quantity::Velocity, 0.3048),
    ("m/s^2", Quantity::Acceleration, 1.0),
    ("m/s2", Quantity::Acceleration, 1.0),
    ("mm/s^2", Quantity::Acceleration, 1e-3),
    ("mm/s2", Quantity::Acceleration, 1e-3),
    ("in/s^2", Quantity::Acceleration, 0.0254),
    ("ft/s^2", Quantity::Acceleration, 0.3048),
    ("um/s^2", Quantity::Acceleration, 1e-6),
    ("g", Quantity::Acceleration, G),
    ("mg", Quantity::Acceleration, 1e-3 * G),
    ("rad", Quantity::Angle, 1.0),
    ("deg", Quantity::Angle, std::f64::consts::PI / 180.0),
    ("Pa", Quantity::Pressure, 1.0),
    ("kPa", Quantity::Pressure, 1e3),
    ("V", Quantity::Voltage, 1.0),
    ("mV", Quantity::Voltage, 1e-3),
    ("uV", Quantity::Voltage, 1e-6),
    ("1", Quantity::Level, 1.0),
    ("", Quantity::Level, 1.0),
];

/// Error for a text that is no known unit; the message lists the known ones.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the unit \"{found}\" is not known{}; known are {}", meant(found), known())]
pub struct UnknownUnit {
    /// Text of the unknown unit, as the file or the user states it.
    pub found: String,
}

/// Message part: the units that differ from the unknown one only in the case of their letters.
fn meant(found: &str) -> String {
    let near: Vec<String> = UNITS
        .iter()
        .filter(|(name, ..)| !name.is_empty() && name.eq_ignore_ascii_case(found))
        .map(|(name, ..)| format!("\"{name}\""))
        .collect();
    if near.is_empty() {
        String::new()
    } else {
        format!(", {} is meant perhaps", near.join(" or "))
    }
}

fn known() -> String {
    let names: Vec<&str> = UNITS
        .iter()
        .map(|unit| unit.0)
        .filter(|name| !name.is_empty())
        .collect();
    names.join(", ")
}

impl FromStr for Unit {
    type Err = UnknownUnit;

    /// Parses a unit, such as `m/s^2`, or a factor with a unit, such as `98.1 m/s^2`: a sample of 1 means 98.1 m/s².
    ///
    /// `²`, `⁻²`, `**`, `m/s/s`, `m s^-2`, `m/sec²`, whole words (`Newton`, `volts`, `sec`) and both Unicode letters
    /// for micro (µ, μ) are accepted.
    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        if let Some(unit) = plain(text) {
            return Ok(unit);
        }
        // The number 1 without a unit is the unit of a level; it has been found above.
        let (number, unit) = leading_number(text).ok_or_else(|| UnknownUnit { found: text.into() })?;
        match plain(unit) {
            Some(unit) if number.is_finite() && number != 0.0 && unit.quantity != Quantity::Level => {
                Ok(Self {
                    factor: number * unit.factor,
                    ..unit
                })
            }
            _ => Err(UnknownUnit { found: text.into() }),
        }
    }
}

/// Parses a unit without a number before it, by its usual spellings; `None` for other texts.
fn plain(text: &str) -> Option<Unit> {
    let plain = text
        .trim()
        .replace('²', "^2")
        .replace(['µ', 'μ'], "u")
        .replace("**", "^");
    let of = |name: &str| {
        UNITS
            .iter()
            .find(|(known, ..)| *known == name)
            .map(|&(_, quantity, factor)| Unit { quantity, factor })
    };
    of(&plain).or_else(|| of(&respelled(&plain)?))
}

/// Standard spelling of a unit that is written in another usual way; `None` for an unknown spelling.
fn respelled(text: &str) -> Option<String> {
    let mut plain = text.replace("⁻^2", "^-2").replace(['·', '⋅', '*'], " ");
    // Brackets around a whole unit or around a part of it are removed: (m/s^2), m/(s^2).
    plain.retain(|letter| !matches!(letter, '(' | ')'));
    let word = match plain.trim().to_lowercase().as_str() {
        "newton" | "newtons" => "N",
        "volt" | "volts" => "V",
        "sec" | "secs" | "second" | "seconds" | "sek" | "sekunden" => "s",
        "msec" | "millisecond" | "milliseconds" => "ms",
        "usec" | "microseconds" => "us",
        "micron" | "microns" | "micrometer" | "micrometre" => "um",
        "meter" | "metre" | "meters" => "m",
        "inch" | "inches" => "in",
        "mils" => "mil",
        "lbs" | "pound-force" => "lbf",
        "g" | "gn" | "g_n" | "g's" | "gs" | "gravity" => "g",
        "ips" => "in/s",
        "-" | "none" | "unitless" => "1",
        "degrees" | "°" => "deg",
        _ => "",
    };
    if !word.is_empty() {
        return Some(word.into());
    }
    let plain = plain.replace("sec", "s").replace("/s/s", "/s^2");
    // The spellings `m s^-2`, `m s-2`, `ms^-2` and `m/s-2` mean `m/s^2`; `m s^-1` means `m/s`.
    let (length, rest) = ["um", "mm", "cm", "m", "in", "ft"]
        .iter()
        .find_map(|length| Some((*length, plain.strip_prefix(length)?)))?;
    let rest: String = rest.chars().filter(|letter| !letter.is_whitespace()).collect();
    match rest.as_str() {
        "/s^2" | "/s2" | "s^-2" | "s-2" | "/s-2" => Some(format!("{length}/s^2")),
        "s^-1" | "s-1" | "/s" => Some(format!("{length}/s")),
        _ => None,
    }
}

/// Splits a text such as `98.1 m/s^2` into the number at its start and the text after it; `None` if one of them is
/// missing.
fn leading_number(text: &str) -> Option<(f64, &str)> {
    let (number, length) = fast_float2::parse_partial::<f64, _>(text.trim_start()).ok()?;
    let rest = text.trim_start().get(length..)?.trim();
    (length > 0 && !rest.is_empty()).then_some((number, rest))
}

/// Sensitivity of a sensor: output voltage per unit of the measured quantity, such as "10.2 mV/g".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensitivity {
    /// Quantity measured by the sensor.
    pub quantity: Quantity,
    /// Sensitivity of the sensor, V per SI unit of `quantity`.
    pub volts_per_unit: f64,
}

impl FromStr for Sensitivity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("\"{text}\"; a sensitivity such as \"10.2 mV/g\" or \"2.2 mV/N\" is needed");
        let (number, units) = leading_number(text).ok_or_else(wrong)?;
        let (volts, measured) = units.split_once('/').ok_or_else(wrong)?;
        let volts: Unit = volts.parse().map_err(|_| wrong())?;
        // Parentheses are allowed around the measured unit of a sensitivity if it has a slash: "mV/(m/s^2)".
        let measured = measured
            .trim()
            .strip_prefix('(')
            .and_then(|inner| inner.strip_suffix(')'))
            .unwrap_or(measured);
        let measured: Unit = measured.parse().map_err(|_| wrong())?;
        let is_measurable = !matches!(
            measured.quantity,
            Quantity::Voltage | Quantity::Level | Quantity::Time
        );
        if volts.quantity != Quantity::Voltage || !is_measurable || !(number.is_finite() && number != 0.0) {
            return Err(wrong());
        }
        Ok(Self {
            quantity: measured.quantity,
            volts_per_unit: number * volts.factor / measured.factor,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_convert_to_si() {
        for (text, quantity, factor) in [
            ("mm", Quantity::Displacement, 1e-3),
            ("µm", Quantity::Displacement, 1e-6),
            ("m/s²", Quantity::Acceleration, 1.0),
            ("g", Quantity::Acceleration, 9.806_65),
            ("kN", Quantity::Force, 1e3),
            ("1", Quantity::Level, 1.0),
        ] {
            assert_eq!(text.parse(), Ok(Unit { quantity, factor }), "{text}");
        }
        for (text, same) in [
            ("m/s/s", "m/s^2"),
            ("m/sec^2", "m/s^2"),
            ("m s^-2", "m/s^2"),
            ("m·s⁻²", "m/s^2"),
            ("(m/s^2)", "m/s^2"),
            ("mm/s²", "mm/s^2"),
            ("Newton", "N"),
            ("sec", "s"),
            ("inch", "in"),
        ] {
            assert_eq!(text.parse::<Unit>(), same.parse(), "{text}");
        }
        let scaled: Unit = "98.1 m/s^2".parse().unwrap();
        assert_eq!((scaled.quantity, scaled.factor), (Quantity::Acceleration, 98.1));
        assert!("0 N".parse::<Unit>().is_err() && "3".parse::<Unit>().is_err());
        let error = "furlong".parse::<Unit>().unwrap_err().to_string();
        assert!(error.contains("furlong") && error.contains("um"), "{error}");
    }

    #[test]
    fn sensitivities_need_a_voltage_and_a_measured_unit() {
        let sensitivity: Sensitivity = "10.2 mV/g".parse().unwrap();
        assert_eq!(sensitivity.quantity, Quantity::Acceleration);
        assert!((sensitivity.volts_per_unit - 10.2e-3 / 9.806_65).abs() < 1e-15);
        assert_eq!("10.2mV/g".parse(), Ok(sensitivity));
        assert_eq!("2 V/(m/s^2)".parse::<Sensitivity>().unwrap().volts_per_unit, 2.0);
        for wrong in ["10.2", "10 mV", "x mV/g", "10 g/mV", "0 mV/g", "10 mV/s"] {
            assert!(wrong.parse::<Sensitivity>().is_err(), "{wrong}");
        }
    }
}
