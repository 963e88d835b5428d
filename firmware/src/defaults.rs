//! What a device assumes until a host tells it otherwise.

use quietcut_core::acceleration::Sensor;
use quietcut_core::monitor::Settings;
use quietcut_core::tachometer::Wheel;
use quietcut_core::working_point::Tool;

/// A tool of four teeth, one mark on the spindle, no limits.
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
