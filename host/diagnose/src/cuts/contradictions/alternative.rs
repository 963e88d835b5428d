//! Other inputs with which a record may fit: another tool, another engagement, other channels.

use std::fmt;

use quietcut_recording::Quantity;

/// One change of the input.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Alternative {
    /// A tool with this number of evenly pitched teeth.
    Teeth(usize),
    /// Entry and exit at these angles, degrees.
    Engagement([f64; 2]),
    /// Entry and exit mirrored at the feed: up-milling for down-milling.
    Mirrored([f64; 2]),
    /// A spindle that rotates the other way; the engagement as given, or mirrored to these angles, degrees.
    Rotation(Option<[f64; 2]>, Vec<String>),
    /// Two channels in the place of each other, with signs.
    Swapped([String; 2], [f64; 2]),
    /// Channels with the opposite sign.
    Inverted(Vec<String>),
    /// Channels in another unit: the true values are those of the record times the factor.
    Unit(Vec<String>, f64, &'static str),
}

impl Alternative {
    /// Channels of the record by name with the channel that is read in their place, and its factor.
    pub(super) fn reads<'a>(&'a self, name: &'a str) -> (&'a str, f64) {
        match self {
            Self::Swapped([one, other], [first, second]) => match name {
                _ if name == one => (other, *first),
                _ if name == other => (one, *second),
                _ => (name, 1.0),
            },
            Self::Inverted(names) | Self::Rotation(_, names) if names.iter().any(|own| own == name) => {
                (name, -1.0)
            }
            Self::Unit(names, factor, _) if names.iter().any(|own| own == name) => (name, *factor),
            _ => (name, 1.0),
        }
    }

    /// Entry and exit, degrees, if they differ from those that are given.
    pub(super) fn engagement_deg(&self) -> Option<[f64; 2]> {
        match self {
            Self::Engagement(degrees) | Self::Mirrored(degrees) | Self::Rotation(Some(degrees), _) => {
                Some(*degrees)
            }
            _ => None,
        }
    }

    /// This input with a fitted entry and exit, degrees.
    pub(super) fn fitted(self, engagement_deg: [f64; 2]) -> Self {
        match self {
            Self::Engagement(_) => Self::Engagement(engagement_deg),
            other => other,
        }
    }

    /// True if the case, and not the record, differs: the same for all records of one tool.
    pub(super) fn is_of_tool(&self) -> bool {
        matches!(self, Self::Teeth(_))
    }
}

impl fmt::Display for Alternative {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let angles = |[start, exit]: &[f64; 2]| format!("start_deg = {start:.0} and exit_deg = {exit:.0}");
        match self {
            Self::Teeth(teeth) => write!(
                f,
                "a tool with {teeth} {} (or other pulses_per_rev of the tachometer)",
                if *teeth == 1 { "tooth" } else { "teeth" }
            ),
            Self::Engagement(degrees) => write!(f, "another engagement, about {}", angles(degrees)),
            Self::Mirrored(degrees) => write!(
                f,
                "the engagement mirrored at the feed (up-milling and down-milling exchanged), {}",
                angles(degrees)
            ),
            Self::Rotation(None, _) => write!(
                f,
                "a spindle that rotates the other way (all channels along y with the opposite sign)"
            ),
            Self::Rotation(Some(degrees), _) => write!(
                f,
                "a spindle that rotates the other way (all channels along y with the opposite sign, {})",
                angles(degrees)
            ),
            Self::Swapped([one, other], signs) => {
                let sign = |sign: f64| if sign < 0.0 { "−" } else { "" };
                write!(
                    f,
                    "{one} and {other} swapped ({one} is {}{other}, {other} is {}{one})",
                    sign(signs[0]),
                    sign(signs[1])
                )
            }
            Self::Inverted(names) => write!(f, "{} with the opposite sign", names.join(", ")),
            Self::Unit(names, factor, words) => {
                write!(f, "{} times {} ({words})", names.join(", "), rounded(*factor))
            }
        }
    }
}

/// A factor with four digits.
fn rounded(factor: f64) -> String {
    let digits = 10_f64.powi(3 - factor.abs().log10().floor() as i32);
    format!("{}", (factor * digits).round() / digits)
}

/// Units that are taken for each other: quantity, factor on the record, words.
const UNITS: [(&[Quantity], f64, &str); 11] = [
    (&[Quantity::Force], 4.448_222, "pounds of force read as N"),
    (&[Quantity::Force], 1.0 / 4.448_222, "N read as pounds of force"),
    (
        &[Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration],
        1.0 / 25.4e-3,
        "m read as inches",
    ),
    (&[Quantity::Force], 9.806_65, "kilograms of force read as N"),
    (&[Quantity::Force], 1.0 / 9.806_65, "N read as kilograms of force"),
    (&[Quantity::Force], 1e3, "kN read as N"),
    (
        &[Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration],
        1e-3,
        "mm read as m",
    ),
    (
        &[Quantity::Displacement, Quantity::Velocity],
        1e-6,
        "µm read as m",
    ),
    (
        &[Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration],
        25.4e-3,
        "inches read as m",
    ),
    (&[Quantity::Acceleration], 9.806_65, "g read as m/s²"),
    (&[Quantity::Acceleration], 1.0 / 9.806_65, "m/s² read as g"),
];

/// Further factors of all quantities: a prefix too many or too few.
const PREFIXES: [(f64, &str); 4] = [
    (1e3, "a thousand, as of a prefix of its unit"),
    (1e-3, "a thousandth, as of a prefix of its unit"),
    (1e6, "a million, as of a prefix of its unit"),
    (1e-6, "a millionth, as of a prefix of its unit"),
];

/// All changes of the channels that are tried, for the names and quantities of the channels of a record.
pub(super) fn of_channels(channels: &[(String, Quantity)]) -> Vec<Alternative> {
    let mut all = Vec::new();
    let mut quantities: Vec<Quantity> = Vec::new();
    for (_, quantity) in channels {
        if !quantities.contains(quantity) {
            quantities.push(*quantity);
        }
    }
    for quantity in quantities {
        let of_it = channels.iter().filter(|(_, own)| *own == quantity);
        let names: Vec<String> = of_it.map(|(name, _)| name.clone()).collect();
        let mut groups: Vec<Vec<String>> = names.iter().map(|name| vec![name.clone()]).collect();
        if names.len() > 1 {
            groups.push(names.clone());
        }
        all.extend(groups.iter().cloned().map(Alternative::Inverted));
        for (index, one) in names.iter().enumerate() {
            for other in &names[index + 1..] {
                for signs in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
                    all.push(Alternative::Swapped([one.clone(), other.clone()], signs));
                }
            }
        }
        let own = UNITS.iter().filter(|(of, ..)| of.contains(&quantity));
        let mut factors: Vec<(f64, &'static str)> = own.map(|(_, factor, words)| (*factor, *words)).collect();
        for prefix in PREFIXES {
            if factors.iter().all(|(factor, _)| *factor != prefix.0) {
                factors.push(prefix);
            }
        }
        for group in &groups {
            let unit =
                |(factor, words): &(f64, &'static str)| Alternative::Unit(group.clone(), *factor, words);
            all.extend(factors.iter().map(unit));
        }
    }
    all
}
