//! Meaning of a column name: quantity, direction and unit, from the words in it.

use super::unit::{Quantity, Unit};

/// Meaning of the words in the name of a column.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NameMeaning {
    /// Quantity that a word in the column name states, such as force for `Hammer`; `None` if none does.
    pub(super) quantity: Option<Quantity>,
    /// True if a word in the column name states the signal of a tachometer.
    pub(super) is_tacho: bool,
    /// Direction that a word in the column name states: `x`, `y` or `z`; `None` if none does.
    pub(super) axis: Option<char>,
    /// True if the direction in the column name has a minus sign, as in `Acc -Z`.
    pub(super) is_negative: bool,
    /// Unit of this quantity at the end of the column name, as in `force_N`; `None` if there is none.
    pub(super) unit: Option<Unit>,
}

/// Words in column names that state a quantity, in lower case, English and German. A word of five letters or more also
/// counts as the start of a longer word.
const WORDS: &[(Quantity, &[&str])] = &[
    (
        Quantity::Time,
        &["t", "time", "timestamp", "zeit", "zeitstempel", "sec", "seconds"],
    ),
    (
        Quantity::Force,
        &[
            "f",
            "force",
            "forces",
            "hammer",
            "impact",
            "kraft",
            "kräfte",
            "kraefte",
            "excitation",
            "anregung",
            "shaker",
            "dyno",
        ],
    ),
    (
        Quantity::Displacement,
        &[
            "disp",
            "displ",
            "displacement",
            "verschiebung",
            "auslenkung",
            "weg",
            "deflection",
        ],
    ),
    (
        Quantity::Velocity,
        &["v", "vel", "velo", "velocity", "geschwindigkeit", "schnelle"],
    ),
    (
        Quantity::Acceleration,
        &[
            "a",
            "acc",
            "accel",
            "acceleration",
            "accelerometer",
            "beschl",
            "beschleunigung",
        ],
    ),
];

/// Words in column names that state the signal of a tachometer.
const TACHO: &[&str] = &["tacho", "tachometer", "drehzahlsensor", "keyphasor"];

/// Smallest number of letters of a listed word that also counts as the start of a longer word in a column name. A
/// choice: `kraft` begins `Kraftsensor`, `acc` must not begin `accuracy`.
const STEM: usize = 5;

/// Words whose presence in a column name means that its other words state nothing: `cutting speed`, `force error`, and
/// settings that are no signal of a sensor.
const OTHER: &[&str] = &[
    "speed",
    "rpm",
    "drehzahl",
    "frequency",
    "freq",
    "frequenz",
    "temp",
    "temperature",
    "temperatur",
    "torque",
    "moment",
    "power",
    "leistung",
    "current",
    "strom",
    "error",
    "std",
    "coherence",
    "index",
    "sample",
    "samples",
    "count",
];

impl NameMeaning {
    /// Meaning of `name`.
    pub(super) fn of(name: &str) -> Self {
        let tokens = tokens(name);
        let lower: Vec<String> = tokens.iter().map(|token| token.to_lowercase()).collect();
        let mut meaning = Self::default();
        if lower.iter().any(|word| OTHER.contains(&word.as_str())) {
            return meaning;
        }
        for (index, word) in lower.iter().enumerate() {
            // A single letter states a quantity only at the start of a name that consists of short words: the `A` of
            // `Channel A` is no acceleration.
            let is_letter = word.chars().count() == 1 && axis(word).is_none();
            // `F` and `a_x` state a quantity. `a1` does not, since it may be the first column of any matrix.
            let others_are_short = lower.iter().all(|other| other.chars().count() <= 2)
                && !lower
                    .get(1)
                    .is_some_and(|next| next.starts_with(|digit: char| digit.is_ascii_digit()));
            if !is_letter || index == 0 && others_are_short {
                meaning.take(word);
            }
        }
        meaning.is_negative = meaning.axis.is_some_and(|axis| has_minus(name, axis));
        if let Some(quantity) = meaning.quantity {
            meaning.unit = unit_at_end(&tokens, quantity);
        }
        meaning
    }

    /// Adds the meaning of one word of a column name; of several words for a quantity, or for a direction, the first
    /// counts.
    fn take(&mut self, word: &str) {
        if let Some(axis) = axis(word) {
            self.axis.get_or_insert(axis);
            return;
        }
        if TACHO.contains(&word) {
            self.is_tacho = true;
            return;
        }
        for (quantity, words) in WORDS {
            for known in *words {
                let Some(rest) = word.strip_prefix(known) else {
                    continue;
                };
                // A word such as `fx`, `accy` or `forcez` states a quantity, and its last letter the direction.
                let direction = axis(rest);
                if rest.is_empty() || direction.is_some() || known.chars().count() >= STEM {
                    self.quantity.get_or_insert(*quantity);
                    if let Some(axis) = direction {
                        self.axis.get_or_insert(axis);
                    }
                    return;
                }
            }
        }
        // A German compound ends with its quantity: `Hammerkraft` (force), `Schwingbeschleunigung` (acceleration).
        for (end, quantity) in [
            ("kraft", Quantity::Force),
            ("beschleunigung", Quantity::Acceleration),
            ("geschwindigkeit", Quantity::Velocity),
        ] {
            if word.ends_with(end) {
                self.quantity.get_or_insert(quantity);
            }
        }
    }
}

/// Direction that a word states if it is x, y or z alone; `None` for other words.
fn axis(word: &str) -> Option<char> {
    match word {
        "x" => Some('x'),
        "y" => Some('y'),
        "z" => Some('z'),
        _ => None,
    }
}

/// True if the direction `axis` stands in the column name with a minus sign, and not after a hyphen within a word: `Acc
/// -Z`, `(-z)`.
fn has_minus(name: &str, axis: char) -> bool {
    let text: Vec<char> = name.to_lowercase().chars().collect();
    (0..text.len()).any(|at| {
        let before = at.checked_sub(1).map(|at| text[at]);
        text[at] == '-'
            && text.get(at + 1) == Some(&axis)
            && before.is_none_or(|before| before.is_whitespace() || before == '(')
    })
}

/// Words of a column name: letters and digits are separated, and a capital after a small letter begins a new word.
fn tokens(name: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut previous: Option<char> = None;
    for letter in name.chars() {
        if letter.is_alphanumeric() {
            let starts = match previous {
                Some(before) if before.is_alphanumeric() => {
                    before.is_numeric() != letter.is_numeric()
                        || (before.is_lowercase() && letter.is_uppercase())
                }
                _ => true,
            };
            match tokens.last_mut() {
                Some(token) if !starts => token.push(letter),
                _ => tokens.push(letter.into()),
            }
        }
        previous = Some(letter);
    }
    tokens
}

/// Unit of the given quantity in the last words of a column name: `force_N`, `acc_g`, `ax_m_s2`; `None` if there is
/// none.
fn unit_at_end(tokens: &[String], quantity: Quantity) -> Option<Unit> {
    let [first, rest @ ..] = tokens else {
        return None;
    };
    // The first word of a column name names the channel, so it is not read as a unit.
    let _ = first;
    (0..rest.len()).find_map(|from| {
        let text = match rest[from..].join("").as_str() {
            "ms2" | "mps2" | "mss" => "m/s^2".to_owned(),
            "mms2" => "mm/s^2".to_owned(),
            "mps" => "m/s".to_owned(),
            other => other.to_owned(),
        };
        // A direction such as x does not parse as a unit, and a unit of another quantity does not count.
        let unit: Unit = text.parse().ok()?;
        (unit.quantity == quantity).then_some(unit)
    })
}

/// Splits a column title into name and unit: `name [unit]`, `name (unit)`, `name {unit}`, `name / unit`, `name in
/// unit`, `name, unit`.
///
/// Square brackets at the end always hold a unit. Other forms count only if the text is a known unit. Without a unit
/// the whole title is the name.
pub(super) fn name_and_unit(title: &str) -> (&str, Option<&str>) {
    let title = title.trim();
    if let Some((name, unit)) = title.strip_suffix(']').and_then(|inner| inner.rsplit_once('[')) {
        return (name.trim(), Some(unit.trim()));
    }
    let is_unit = |text: &str| !text.trim().is_empty() && text.parse::<Unit>().is_ok();
    for (open, close) in [('(', ')'), ('{', '}')] {
        let Some(inner) = title.strip_suffix(close) else {
            continue;
        };
        // A unit such as (m/(s^2)) contains brackets, so each opening bracket may be the one before the unit.
        for (at, _) in inner.match_indices(open) {
            let (name, unit) = (&inner[..at], &inner[at + 1..]);
            if is_unit(unit) {
                return (name.trim(), Some(unit.trim()));
            }
        }
    }
    for between in [" / ", "/", " in ", ", "] {
        if let Some((name, unit)) = title.split_once(between)
            && is_unit(unit)
            && !name.trim().is_empty()
        {
            return (name.trim(), Some(unit.trim()));
        }
    }
    (title, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_name_quantity_and_direction() {
        use Quantity::{Acceleration, Displacement, Force, Time, Velocity};
        for (name, quantity, axis) in [
            ("Time", Some(Time), None),
            ("Zeit", Some(Time), None),
            ("Hammer", Some(Force), None),
            ("Kraft", Some(Force), None),
            ("Hammerkraft", Some(Force), None),
            ("Acc X", Some(Acceleration), Some('x')),
            ("AccelY", Some(Acceleration), Some('y')),
            ("accz", Some(Acceleration), Some('z')),
            ("Acceleration (z)", Some(Acceleration), Some('z')),
            ("Beschleunigung_x", Some(Acceleration), Some('x')),
            ("force1", Some(Force), None),
            ("F", Some(Force), None),
            ("ax", Some(Acceleration), Some('x')),
            ("fy", Some(Force), Some('y')),
            ("velocity Z", Some(Velocity), Some('z')),
            ("Weg Y", Some(Displacement), Some('y')),
            ("X", None, Some('x')),
            ("accuracy", None, None),
            ("Cutting force error", None, None),
            ("Spindle speed", None, None),
            ("ch1", None, None),
        ] {
            let meaning = NameMeaning::of(name);
            assert_eq!((meaning.quantity, meaning.axis), (quantity, axis), "{name}");
        }
        assert!(NameMeaning::of("Acc -Z").is_negative);
        assert!(!NameMeaning::of("Acc-Z").is_negative);
        assert!(NameMeaning::of("Tacho").is_tacho);
    }

    #[test]
    fn units_stand_behind_the_name_in_several_forms() {
        for (title, name, unit) in [
            ("Force (N)", "Force", Some("N")),
            ("Acc X [g]", "Acc X", Some("g")),
            ("Acceleration (m/s^2)", "Acceleration", Some("m/s^2")),
            ("Acceleration (X)", "Acceleration (X)", None),
            ("Kraft in kN", "Kraft", Some("kN")),
            ("F/N", "F", Some("N")),
            ("t / s", "t", Some("s")),
            ("ax [parsec]", "ax", Some("parsec")),
            ("Acc (top) (g)", "Acc (top)", Some("g")),
            ("data", "data", None),
        ] {
            assert_eq!(name_and_unit(title), (name, unit), "{title}");
        }
        let unit = |name: &str| NameMeaning::of(name).unit.map(|unit| unit.factor);
        assert_eq!(unit("force_kN"), Some(1e3));
        assert_eq!(unit("acc_x_g"), Some(9.806_65));
        assert_eq!(unit("accel_m_s2"), Some(1.0));
        assert_eq!(unit("time_ms"), Some(1e-3));
        assert_eq!(unit("force"), None);
    }
}
