//! Rigid carrier with three inertial ports as an FMU. The model: `models::suspension::link3`.
fmu_export::export!(models::suspension::Link3);
