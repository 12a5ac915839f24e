//! Planar double pendulum as an FMU. The model: `models::suspension::double_pendulum`.
fmu_export::export!(models::suspension::DoublePendulum);
