//! VTK's formats of unstructured grids: <https://docs.vtk.org/en/latest/vtk_file_formats/index.html>.

mod cells;
mod data_array;
mod legacy;
mod xml;

pub use legacy::read as read_legacy;
pub use xml::read as read_xml;
