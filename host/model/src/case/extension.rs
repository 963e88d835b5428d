//! Extensions of the model: what `diagnose` adds, or the user switches on.

/// The names that a table `[extension.NAME]` may have.
pub const NAMES: [&str; 25] = [
    "mass",
    "stiffness",
    "damping",
    "missing-mode",
    "cubic-stiffness",
    "quadratic-stiffness",
    "cubic-damping",
    "softening-hardening",
    "coulomb-friction",
    "backlash",
    "hysteresis",
    "mode-coupling",
    "drift",
    "force-coefficients",
    "edge-force",
    "force-exponent",
    "runout",
    "process-damping",
    AXIAL_DEPTH_MODULATION,
    "speed-fluctuation",
    "wear",
    "sensor-gain",
    "sensor-delay",
    "cross-axis",
    "sensor-offset-from-tool-tip",
];

/// The depth of cut follows the axial vibration, b = b₀ − z (thesis eq. 3.5).
pub const AXIAL_DEPTH_MODULATION: &str = "axial-depth-modulation";

/// Extensions of the sensors: the cut itself does not know of them.
pub const OF_SENSORS: [&str; 4] = [
    "sensor-gain",
    "sensor-delay",
    "cross-axis",
    "sensor-offset-from-tool-tip",
];
