//! Head of the section of a sidecar about a channel.

/// Head of the section of a sidecar about the channel that a file calls `name`, quoted where TOML requires it:
/// `[channels.ax]`, `[channels."Acc X"]`.
pub fn channel_section(name: &str) -> String {
    let is_bare = name
        .chars()
        .all(|letter| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-');
    if is_bare && !name.is_empty() {
        format!("[channels.{name}]")
    } else {
        format!("[channels.\"{name}\"]")
    }
}
