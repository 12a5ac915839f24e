//! A scene as one Co-Simulation FMU: the library is the same for all scenes. The instance: `host::assembly`.
fmu_export::export_instance!(host::assembly::Assembly);
