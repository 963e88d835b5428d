//! Number of draws of a test that runs in every run of the tests, and of the same test in the campaigns.

/// `part` draws; `whole` if the environment variable `QUIETCUT_WHOLE` is set, as `tests/run --full` does.
///
/// A test that draws `whole` points takes long. Of `part` points it still fails if its claim is far off.
pub fn slice(part: u64, whole: u64) -> u64 {
    if std::env::var_os("QUIETCUT_WHOLE").is_some() {
        whole
    } else {
        part
    }
}
