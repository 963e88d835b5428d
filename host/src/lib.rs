//! What quietcut does with measured data.
