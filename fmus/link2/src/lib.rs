//! Rigid rod with two inertial ports as an FMU. The model: `models::suspension::link2`.
fmu_export::export!(models::suspension::Link2);
