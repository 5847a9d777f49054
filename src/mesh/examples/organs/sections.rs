//! Sections of the organs as SVG: the outline of the shape, its lump, and the elements that the plane cuts.

use std::error::Error;
use std::fmt::Write;

use palpate_mesh::organs::{self, Organ};
use palpate_mesh::{ImplicitShape, Sizes};
use palpate_model::Vec3;
use palpate_model::mesh::{Group, TetrahedralMesh};

/// Cells of the grid along x on which outlines are found.
const GRID: usize = 150;

/// One drawing: the section of an organ with the plane y = `at`.
struct Section {
    title: String,
    shape: Organ,
    mesh: TetrahedralMesh,
    at: f64,
    /// Pixels per metre.
    scale: f64,
    /// x at the left, z at the bottom (m), and where they lie in the picture.
    corner: [f64; 2],
    place: [f64; 2],
    extent: [f64; 2],
    tick: f64,
}

/// Both organs, below each other.
pub fn draw() -> Result<String, Box<dyn Error>> {
    let (liver, prostate) = (Sizes::uniform(0.006), Sizes::uniform(0.003));
    let sections = [
        Section {
            title: "liver, 6 mm elements: section at y = -4 mm through the tumour".into(),
            shape: organs::liver_shape(),
            mesh: organs::liver(liver)?,
            at: -0.004,
            scale: 4600.0,
            corner: [-0.075, 0.0],
            place: [70.0, 260.0],
            extent: [0.155, 0.044],
            tick: 0.02,
        },
        Section {
            title: "prostate, 3 mm elements: section at y = -2 mm through the nodule".into(),
            shape: organs::prostate_shape(),
            mesh: organs::prostate(prostate)?,
            at: -0.002,
            scale: 9200.0,
            corner: [-0.030, 0.0],
            place: [145.0, 590.0],
            extent: [0.060, 0.027],
            tick: 0.01,
        },
    ];
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 840 660\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"840\" height=\"660\" fill=\"white\"/>\n",
    );
    for section in &sections {
        section.elements(&mut svg)?;
        section.contour(&mut svg, |x| section.shape.signed_distance(x), "#1d3557", 2.2)?;
        section.contour(&mut svg, |x| section.shape.lump_distance(x), "#d62828", 2.2)?;
        section.axes(&mut svg)?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

impl Section {
    /// Where (x, z) in metres is drawn.
    fn pixel(&self, x: f64, z: f64) -> [f64; 2] {
        [self.place[0] + (x - self.corner[0]) * self.scale, self.place[1] - (z - self.corner[1]) * self.scale]
    }

    fn axes(&self, svg: &mut String) -> std::fmt::Result {
        let [left, bottom] = self.place;
        let [width, height] = self.extent.map(|x| x * self.scale);
        writeln!(svg, "<text x=\"{left}\" y=\"{:.1}\" font-size=\"15\">{}</text>", bottom - height - 14.0, self.title)?;
        writeln!(
            svg,
            "<path d=\"M{left} {:.1}V{bottom}H{:.1}\" fill=\"none\" stroke=\"#444\"/>",
            bottom - height,
            left + width
        )?;
        let ticks = |low: f64, extent: f64| {
            let first = (low / self.tick).ceil() as i32;
            (first..).map(|n| f64::from(n) * self.tick).take_while(move |x| *x <= low + extent + 1e-9)
        };
        for x in ticks(self.corner[0], self.extent[0]) {
            let [at, _] = self.pixel(x, 0.0);
            writeln!(svg, "<path d=\"M{at:.1} {bottom}v5\" stroke=\"#444\"/>")?;
            writeln!(
                svg,
                "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{:.0}</text>",
                bottom + 19.0,
                1e3 * x
            )?;
        }
        for z in ticks(self.corner[1], self.extent[1]) {
            let [_, at] = self.pixel(0.0, z);
            writeln!(svg, "<path d=\"M{left} {at:.1}h-5\" stroke=\"#444\"/>")?;
            writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{:.0}</text>",
                left - 9.0,
                at + 4.5,
                1e3 * z
            )?;
        }
        writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">x (mm)</text>",
            left + width / 2.0,
            bottom + 38.0
        )?;
        writeln!(
            svg,
            "<text transform=\"translate({:.1} {:.1}) rotate(-90)\" text-anchor=\"middle\">z (mm)</text>",
            left - 38.0,
            bottom - height / 2.0
        )
    }

    /// The polygons in which the plane cuts the elements, those of a colour in one path.
    fn elements(&self, svg: &mut String) -> std::fmt::Result {
        let lump = self.mesh.group("tumour").or(self.mesh.group("nodule"));
        let capsule = self.mesh.group("capsule");
        let mut paths = [("#f6e7d8", String::new()), ("#cfe3f1", String::new()), ("#f4a3a3", String::new())];
        for n in 0..self.mesh.tetrahedra.len() as u32 {
            let is_in = |group: Option<&Group>| group.is_some_and(|group| group.tetrahedra.binary_search(&n).is_ok());
            let kind = if is_in(lump) { 2 } else { usize::from(is_in(capsule)) };
            for (m, [x, y]) in self.polygon(n).into_iter().enumerate() {
                write!(paths[kind].1, "{}{x:.0} {y:.0}", if m == 0 { "ZM" } else { " " })?;
            }
        }
        for (fill, path) in paths.iter().filter(|(_, path)| !path.is_empty()) {
            let shapes = &path[1..];
            writeln!(
                svg,
                "<path d=\"{shapes}Z\" transform=\"scale(0.1)\" fill=\"{fill}\" stroke=\"#8a8a8a\" stroke-width=\"6\"/>"
            )?;
        }
        Ok(())
    }

    /// The polygon in which the plane cuts an element, in tenths of pixels; empty where it does not.
    fn polygon(&self, element: u32) -> Vec<[f64; 2]> {
        let corners = self.mesh.tetrahedra[element as usize].map(|node| self.mesh.points[node as usize]);
        let mut points: Vec<[f64; 2]> = Vec::new();
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let (low, high) = (corners[a].y - self.at, corners[b].y - self.at);
            if (low < 0.0) != (high < 0.0) {
                let x = corners[a] + (corners[b] - corners[a]) * (low / (low - high));
                points.push(self.pixel(x.x, x.z).map(|x| 10.0 * x));
            }
        }
        let middle = [0, 1].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64);
        let angle = |p: &[f64; 2]| (p[1] - middle[1]).atan2(p[0] - middle[0]);
        points.sort_by(|one, other| angle(one).total_cmp(&angle(other)));
        points
    }

    /// Where `distance` is zero in the plane: marching triangles over a fine grid.
    fn contour(&self, svg: &mut String, distance: impl Fn(&Vec3) -> f64, colour: &str, width: f64) -> std::fmt::Result {
        let step = self.extent[0] / GRID as f64;
        let rows = (self.extent[1] / step) as usize;
        let at = |[i, j]: [usize; 2]| {
            let x = Vec3::new(self.corner[0] + i as f64 * step, self.at, self.corner[1] + (j as f64 - 1.5) * step);
            (x, distance(&x))
        };
        let mut path = String::new();
        for [i, j] in (0..GRID).flat_map(|i| (0..rows + 3).map(move |j| [i, j])) {
            for triangle in [[[i, j], [i + 1, j], [i + 1, j + 1]], [[i, j], [i + 1, j + 1], [i, j + 1]]] {
                let corners = triangle.map(at);
                let mut ends = Vec::new();
                for n in 0..3 {
                    let ((from, a), (to, b)) = (corners[n], corners[(n + 1) % 3]);
                    if (a < 0.0) != (b < 0.0) {
                        let x = from + (to - from) * (a / (a - b));
                        ends.push(self.pixel(x.x, x.z));
                    }
                }
                if let [from, to] = ends[..] {
                    write!(path, "M{:.1} {:.1}L{:.1} {:.1}", from[0], from[1], to[0], to[1])?;
                }
            }
        }
        writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>"
        )
    }
}
