//! Keys whose values are not compared, each with its reason.

use crate::comparison::Rule;

/// Keys of an answer that no rule compares.
const NEVER: &[(&str, &str)] = &[
    ("why", "prose: the reason of an advice or a choice"),
    ("warnings", "prose"),
    ("message", "prose"),
    ("where", "prose: a location in words"),
    ("guess", "prose: a restoring force that no cause explains"),
    ("blind_to", "prose: effects that a method leaves out"),
    ("settings", "prose: settings of a method in words"),
    ("unknowns", "prose: uncertain quantities of a plan in words"),
    ("out", "paths of files; the files themselves are compared"),
];

/// Keys that are not compared in the answers of one verb: verb, key, reason.
const NEVER_OF_VERB: &[(&str, &str, &str)] = &[
    ("demo", "seconds", "time that the command took"),
    ("info", "uptime_s", "time since the simulated device was started"),
];

/// Keys that only the comparison to the bit includes.
const ONLY_BITS: &[(&str, &str)] = &[(
    "text_hash",
    "hash of all bytes of a table: another processor rounds differently; the reference holds rows and sums",
)];

/// True if `rule` does not compare the value of `key` in an answer of `verb`.
pub(crate) fn is_uncompared(verb: &str, key: &str, rule: Rule) -> bool {
    let among = |list: &[(&str, &str)]| list.iter().any(|(name, _)| *name == key);
    let of_verb = NEVER_OF_VERB.iter().any(|(v, k, _)| *v == verb && *k == key);
    among(NEVER) || of_verb || (rule == Rule::Tolerance && among(ONLY_BITS))
}
