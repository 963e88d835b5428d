//! Parser for numbers in Fortran notation: exponents with E, D, Q or without letter, adjacent fields without blank.

/// Parses all numbers of a line and appends them to `values`.
///
/// Accepted forms: `1.5D+02`, `1.5-102` (Fortran drops the letter of a three-digit exponent), `-1.0E+00-2.0E+00`
/// (adjacent fields), commas between numbers, `NaN` and infinities.
///
/// # Errors
/// A message with the text that is not a number.
pub(super) fn append(line: &[u8], values: &mut Vec<f64>) -> Result<(), String> {
    let mut rest = line;
    loop {
        rest = rest.trim_ascii_start();
        if let Some(after) = rest.strip_prefix(b",") {
            rest = after.trim_ascii_start();
        }
        if rest.is_empty() {
            return Ok(());
        }
        let (value, length) = number(rest).ok_or_else(|| {
            let end = rest
                .iter()
                .position(|&byte| byte.is_ascii_whitespace() || byte == b',')
                .unwrap_or(rest.len());
            // The message shows at most 40 bytes, because a damaged file may have a long line without blanks.
            format!(
                "\"{}\"; a number is needed",
                String::from_utf8_lossy(&rest[..end.min(40)])
            )
        })?;
        values.push(value);
        rest = &rest[length..];
    }
}

/// Parses the number at the start of `text`, in Fortran notation. Returns its value and its length in bytes; `None` if
/// there is no number, or other text directly after it.
fn number(text: &[u8]) -> Option<(f64, usize)> {
    let (value, length) = fast_float2::parse_partial::<f64, _>(text).ok()?;
    let rest = &text[length..];
    let has_exponent = text[..length].iter().any(|byte| matches!(byte, b'e' | b'E'));
    let (exponent, skipped) = match rest {
        [] => return Some((value, length)),
        [first, ..] if first.is_ascii_whitespace() || *first == b',' => return Some((value, length)),
        [b'D' | b'd' | b'Q' | b'q', after @ ..] if !has_exponent => (after, 1),
        // A sign and exactly three digits after a number, without a digit or decimal point after them, are an exponent
        // without its letter.
        [b'+' | b'-', ..] if !has_exponent && is_bare_exponent(rest) => (rest, 0),
        [b'+' | b'-', ..] => return Some((value, length)),
        _ => return None,
    };
    let digits = exponent_length(exponent);
    if digits == 0 {
        return None;
    }
    let mut plain = text[..length].to_vec();
    plain.push(b'e');
    plain.extend(&exponent[..digits]);
    let value = fast_float2::parse::<f64, _>(&plain).ok()?;
    Some((value, length + skipped + digits))
}

/// True if `text` begins with an exponent without letter: a sign and exactly three digits, no decimal point.
fn is_bare_exponent(text: &[u8]) -> bool {
    exponent_length(text) == 4 && text.get(4) != Some(&b'.')
}

/// Length in bytes of the digits of an exponent with their optional sign; 0 if there are no digits.
fn exponent_length(text: &[u8]) -> usize {
    let sign = usize::from(matches!(text, [b'+' | b'-', ..]));
    let digits = text[sign..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count();
    if digits == 0 { 0 } else { sign + digits }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<f64>, String> {
        let mut values = Vec::new();
        append(text.as_bytes(), &mut values).map(|()| values)
    }

    #[test]
    fn fortran_numbers_are_parsed() {
        for (text, values) in [
            ("  1.5D+02 -2.5d0", vec![150.0, -2.5]),
            ("1.5-102 2.5+100", vec![1.5e-102, 2.5e100]),
            ("-1.47553E-02-1.72957E-02", vec![-1.475_53e-2, -1.729_57e-2]),
            ("1,2, 3", vec![1.0, 2.0, 3.0]),
            ("-1", vec![-1.0]),
            ("1.0-2.0", vec![1.0, -2.0]),
            ("1-100.5", vec![1.0, -100.5]),
            ("+3.0e+1", vec![30.0]),
            ("", vec![]),
        ] {
            assert_eq!(read(text).as_deref(), Ok(values.as_slice()), "{text}");
        }
        assert!(read("NaN").unwrap()[0].is_nan());
        for wrong in ["abc", "1.0x", "1.0D", "--1", "1.0 ? 2", "\u{fffd}"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
