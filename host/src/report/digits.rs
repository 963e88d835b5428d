//! Numbers as text for a reader, without an exponent such as in `6.86495e2`.

/// A number with this many significant digits: as a decimal number from 0.0001 to below 10⁶, where all digits before
/// the point are shown; otherwise with a power of ten, as in `6.86·10¹²`. Zero is `0`.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    // The exponent of the rounded number, so that 9.9996 with four digits is 10.00.
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    let Some((mantissa, exponent)) = text.split_once('e') else {
        return text;
    };
    let Ok(power) = exponent.parse::<i32>() else {
        return text;
    };
    if (-4..6).contains(&power) {
        // Number of decimals that shows `digits` significant digits; none if all these digits stand before the point.
        let decimals = (digits as i32 - 1 - power).max(0) as usize;
        return format!("{value:.decimals$}");
    }
    format!("{mantissa}·10{}", superscript(power))
}

/// Text of the exponent of a power of ten in superscript digits.
fn superscript(power: i32) -> String {
    power
        .to_string()
        .chars()
        .map(|digit| match digit {
            '-' => '⁻',
            '0' => '⁰',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            _ => '⁹',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_digits_and_have_no_exponent() {
        for (value, text) in [
            (686.495, "686.5"),
            (0.000_123_456, "0.0001235"),
            (9.9996, "10.00"),
            (-12_345.6, "-12346"),
            (999_999.9, "1.000·10⁶"),
            (6.864_95e12, "6.865·10¹²"),
            (3.2e-9, "3.200·10⁻⁹"),
            (0.0, "0"),
        ] {
            assert_eq!(significant(value, 4), text);
        }
    }
}
