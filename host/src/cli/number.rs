//! Parsers of numbers on the command line.

use std::num::NonZeroU8;

use crate::case::SPEED_MAX_RPM;

/// Parses a finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a number")),
    }
}

/// Parses a number greater than 0, such as a speed, a depth or a duration.
pub fn positive(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(format!("{value} is not possible: it must be greater than 0"))
    }
}

/// Parses a number of 0 or more.
pub fn non_negative(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if value >= 0.0 {
        Ok(value)
    } else {
        Err(format!("{value} is not possible: it must be 0 or greater"))
    }
}

/// Parses a spindle speed that a case can state, rev/min; 0 is standstill.
pub fn spindle_speed(text: &str) -> Result<f64, String> {
    let value = non_negative(text)?;
    if value <= SPEED_MAX_RPM {
        Ok(value)
    } else {
        Err(format!(
            "{value} is not possible: it must be from 0 to {SPEED_MAX_RPM} rev/min"
        ))
    }
}

/// Parses an immersion angle of the command line from 0 to 360 degrees.
pub fn angle(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if (0.0..=360.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!(
            "{value} is not possible: it must be from 0 to 360 degrees"
        ))
    }
}

/// Parses a whole number from 1 to 255, such as the number of teeth.
pub fn count(text: &str) -> Result<NonZeroU8, String> {
    text.parse()
        .map_err(|_| format!("`{text}` is not possible: it must be a whole number from 1 to 255"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_outside_the_allowed_range_are_refused() {
        assert_eq!(positive("2.5"), Ok(2.5));
        assert_eq!(non_negative("0"), Ok(0.0));
        for text in ["0", "-1", "nan", "inf", "two", ""] {
            assert!(positive(text).is_err(), "{text}");
        }
        assert!(non_negative("-0.1").is_err());
        assert!(angle("180").is_ok() && angle("-1").is_err() && angle("361").is_err());
        assert_eq!(count("4").map(NonZeroU8::get), Ok(4));
        for text in ["0", "256", "2.0", "-1"] {
            assert!(count(text).is_err(), "{text}");
        }
    }
}
