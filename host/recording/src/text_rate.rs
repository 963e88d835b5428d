//! Sample rate in a line of prose or comment, such as `Fs = 25600 Hz` or `dt: 0.1 ms`.

/// Words that announce a sample rate in the head of a text file, in lower case.
const RATE_WORDS: &[&str] = &[
    "sample rate",
    "sampling rate",
    "samplerate",
    "sample_rate",
    "sampling_rate",
    "sampling frequency",
    "sample frequency",
    "sampling freq",
    "sampling_frequency",
    "abtastrate",
    "abtastfrequenz",
    "samples per second",
    "fs",
];

/// Words that announce a sample interval in the head of a text file, in lower case.
const INTERVAL_WORDS: &[&str] = &[
    "sample interval",
    "sampling interval",
    "sample period",
    "sample_interval",
    "abtastintervall",
    "delta t",
    "delta_t",
    "delta_x",
    "time step",
    "dt",
];

/// Sample rate, samples per second, from the rate or the interval that a line such as `Fs = 25600 Hz` or `dt: 0.1 ms`
/// states; `None` if no positive number is found after such a word.
pub(super) fn rate(line: &str, decimal_comma: bool) -> Option<f64> {
    let lower = line.to_lowercase();
    let after = |words: &[&str]| {
        words.iter().find_map(|word| {
            let at = lower.find(word)?;
            let before = lower[..at].chars().next_back();
            let rest = &lower[at + word.len()..];
            let is_word = !before.is_some_and(char::is_alphanumeric)
                && !rest.chars().next().is_some_and(char::is_alphanumeric);
            is_word.then(|| rest.to_owned())
        })
    };
    let number = |rest: &str| {
        let at = rest.find(|letter: char| letter.is_ascii_digit())?;
        // Between the word and its number at most four letters may stand (a unit such as `Hz`), so that no other
        // sentence is read as a rate or an interval.
        if rest[..at].chars().filter(|letter| letter.is_alphabetic()).count() > 4 {
            return None;
        }
        let mut digits = rest[at..].to_owned();
        if decimal_comma {
            digits = digits.replacen(',', ".", 1);
        }
        let (value, length) = fast_float2::parse_partial::<f64, _>(&digits).ok()?;
        let units = format!("{} {}", &rest[..at], &digits[length..]);
        (value.is_finite() && value > 0.0).then_some((value, units))
    };
    let has = |units: &str, word: &str| {
        units
            .split(|letter: char| !(letter.is_alphanumeric() || "µμ".contains(letter)))
            .any(|part| part == word)
    };
    if let Some((value, units)) = after(RATE_WORDS).and_then(|rest| number(&rest)) {
        // `MS/s` are 10⁶ samples per second; `ms` alone is the unit of an interval, as in brackets behind a rate.
        let factor = if has(&units, "khz") || has(&units, "ks") {
            1e3
        } else if has(&units, "mhz") || units.contains("ms/s") {
            1e6
        } else {
            1.0
        };
        return Some(factor * value);
    }
    let (value, units) = after(INTERVAL_WORDS).and_then(|rest| number(&rest))?;
    let factor = if has(&units, "ms") {
        1e-3
    } else if has(&units, "us") || has(&units, "µs") || has(&units, "μs") {
        1e-6
    } else {
        1.0
    };
    Some(1.0 / (factor * value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_rates_are_read_from_lines_of_prose() {
        for (line, rate_hz) in [
            ("Fs = 25600", Some(25_600.0)),
            ("Sample Rate: 51.2 kHz", Some(51_200.0)),
            ("Sample rate (Hz),2048", Some(2048.0)),
            ("dt = 0.5 ms", Some(2000.0)),
            ("Sample rate: 1.2 MS/s", Some(1.2e6)),
            ("Sample rate: 50 kS/s", Some(50_000.0)),
            ("Sample rate: 1000 (1 ms)", Some(1000.0)),
            ("Delta_X;0.001", Some(1000.0)),
            ("offset 3", None),
            ("Fs is the rate of the second channel 3", None),
        ] {
            let found = rate(line, false);
            assert_eq!(found.map(|found| found.round()), rate_hz, "{line}");
        }
        assert_eq!(rate("Abtastrate: 25,6 kHz", true), Some(25_600.0));
    }
}
