//! Time stamps in text tables: clock times and ISO 8601 date times.

/// Seconds of a clock time (`12:00:01.5`, `00:01.5`), or of a date and a clock time (`2024-05-03T12:00:01.5Z`,
/// `03.05.2024 12:00:01`), from midnight, or from the start of 2020, so that double precision resolves 30 ns. `None`
/// for other text. The time zone is left out: one file has one.
pub(super) fn seconds(field: &str, decimal_comma: bool) -> Option<f64> {
    let field = field.trim();
    if !field.contains(':') {
        return None;
    }
    match field.split_once(['T', ' ']) {
        Some((day, time)) => Some(86_400.0 * days(day)? as f64 + clock(without_zone(time), decimal_comma)?),
        None => clock(without_zone(field), decimal_comma),
    }
}

/// The clock time without `Z` or `+02:00` at its end.
fn without_zone(time: &str) -> &str {
    let time = time.trim().trim_end_matches(['Z', 'z']);
    time.rfind(['+', '-']).map_or(time, |at| &time[..at]).trim()
}

/// Seconds of `hours:minutes:seconds` or `minutes:seconds`, the seconds with or without fraction.
fn clock(time: &str, decimal_comma: bool) -> Option<f64> {
    let parts: Vec<&str> = time.split(':').collect();
    let (hours, minutes, seconds) = match *parts.as_slice() {
        [hours, minutes, seconds] => (hours, minutes, seconds),
        [minutes, seconds] if seconds.contains(['.', ',']) => ("0", minutes, seconds),
        _ => return None,
    };
    let seconds = if decimal_comma {
        seconds.replace(',', ".")
    } else {
        seconds.to_owned()
    };
    let is_plain = seconds
        .chars()
        .all(|letter| letter.is_ascii_digit() || letter == '.');
    let seconds: f64 = seconds.parse().ok().filter(|_| is_plain)?;
    let (hours, minutes): (u32, u32) = (hours.parse().ok()?, minutes.parse().ok()?);
    (minutes < 60 && seconds < 61.0).then(|| f64::from(3600 * hours.min(1_000_000) + 60 * minutes) + seconds)
}

/// Days from the start of 2020 to a date, `2024-05-03`, `2024/05/03` or `03.05.2024` (day first).
fn days(date: &str) -> Option<i64> {
    let number = |text: &str| text.parse::<i64>().ok().filter(|_| text.len() <= 4);
    let (year, month, day) = if let Some((day, rest)) = date.split_once('.') {
        let (month, year) = rest.split_once('.')?;
        (number(year)?, number(month)?, number(day)?)
    } else {
        let separator = if date.contains('-') { '-' } else { '/' };
        let mut parts = date.split(separator);
        let found = (
            number(parts.next()?)?,
            number(parts.next()?)?,
            number(parts.next()?)?,
        );
        if parts.next().is_some() {
            return None;
        }
        found
    };
    if !(1900..=2200).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Days of the civil calendar with years that begin in March, so that the leap day is the last of its year.
    let of = |year: i64, month: i64, day: i64| {
        let (year, month) = if month > 2 {
            (year, month - 3)
        } else {
            (year - 1, month + 9)
        };
        365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day
    };
    Some(of(year, month, day) - of(2020, 1, 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_become_seconds() {
        let day = 86_400.0;
        for (text, value) in [
            ("00:00:00.25", Some(0.25)),
            ("2020-01-01T00:00:01", Some(1.0)),
            ("2020-03-01 00:00:00.5Z", Some(60.0 * day + 0.5)),
            ("2021-01-01T12:00:00+02:00", Some(366.5 * day)),
            ("01.02.2020 00:00:03", Some(31.0 * day + 3.0)),
            ("2024/05/03 00:00:00", Some(1584.0 * day)),
            ("2024-05-03", None),
            ("12:61:00", None),
            ("12:00", None),
            ("a:b:c", None),
        ] {
            assert_eq!(seconds(text, false), value, "{text}");
        }
    }
}
