//! Rigid rod with a strut and inertial ports as an FMU. The model: `models::suspension::strut_link`.
fmu_export::export!(models::suspension::StrutLink);
