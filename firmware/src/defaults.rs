//! The settings of a device until a host changes them.

use quietcut_core::acceleration::Sensor;
use quietcut_core::monitor::Settings;
use quietcut_core::tachometer::Wheel;
use quietcut_core::working_point::Tool;

/// Settings of a new device: a tool of four teeth, a tachometer with one mark per revolution, no speed limits.
pub const fn settings(sensor: Sensor) -> Settings {
    Settings {
        sensor,
        tool: Tool { teeth: 4 },
        wheel: Some(Wheel {
            positions: 1,
            missing: 0,
        }),
        assumed_speed: None,
        limits: None,
    }
}
