//! Planar four-bar linkage as an FMU. The model: `models::suspension::four_bar`.
fmu_export::export!(models::suspension::FourBar);
