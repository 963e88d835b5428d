//! What several tests share: where the binary, the cases and the measured data are.
