//! Double wishbone wheel suspension as a co-simulation FMU. The model: `models::suspension`.
fmu_export::export!(models::suspension::DoubleWishbone);
