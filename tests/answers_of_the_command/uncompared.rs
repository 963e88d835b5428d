//! Keys whose values are not compared, each with its reason.

use crate::comparison::Rule;

/// Keys that no rule compares.
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

/// Keys that only the rule of bits compares.
const ONLY_BITS: &[(&str, &str)] = &[(
    "text_hash",
    "hash of all bytes of a table: another processor rounds differently; the reference holds rows and sums",
)];

/// Whether `rule` passes over the value of `key`.
pub(crate) fn is_uncompared(key: &str, rule: Rule) -> bool {
    let among = |list: &[(&str, &str)]| list.iter().any(|(name, _)| *name == key);
    among(NEVER) || (rule == Rule::Tolerance && among(ONLY_BITS))
}
