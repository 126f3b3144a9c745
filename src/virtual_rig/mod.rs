//! stub
#![allow(missing_docs)]
#[derive(Debug, Clone, serde::Deserialize)]
pub struct VirtualConfig {}
impl VirtualConfig {
    pub fn keep_wall_clock(&mut self) {}
}
#[derive(Debug)]
pub struct VirtualRig;
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("x")]
pub struct VirtualRigError;
impl VirtualRig {
    pub fn open(
        _: &VirtualConfig,
        _: &std::path::Path,
        _: &crate::acoustics::Array,
        _: crate::acoustics::Medium,
        _: f64,
        _: crate::rig::Frame,
    ) -> Result<Self, VirtualRigError> {
        Ok(Self)
    }
    pub fn ports(&self) -> crate::rig::Ports {
        Default::default()
    }
}
