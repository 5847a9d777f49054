//! One frame: the body with painter's algorithm, the tool, the force arrow and a caption, as SVG.

use std::fmt::Write as _;

use palpate::model::Vec3;
use palpate::session::ToolView;

use crate::camera::{Camera, Seen};
use crate::shading::{Shaded, shade};

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 600.0;
/// The body is shown between these corners (px).
const FRAME: [[f64; 2]; 2] = [[60.0, 165.0], [900.0, 530.0]];
/// Radius of the tool's tip as it is drawn (m); the tool itself is the point at its bottom.
const TIP_RADIUS: f64 = 0.0034;
/// The handle leans this way.
const HANDLE: Vec3 = Vec3::new(0.044, 0.022, 0.05);
/// Length of the arrow per force (m/N).
const ARROW_PER_NEWTON: f64 = 0.06;
/// Below this the arrow has no direction to show (N).
const NO_FORCE: f64 = 0.02;
/// How far pieces reach over their edges (px), and how much a sliver may grow by that.
const OVERLAP: f64 = 0.35;
const WIDEST: f64 = 1.5;

/// Draws the surface of a body that was at `rest` and the tool at one moment.
pub fn draw(triangles: &[[u32; 3]], rest: &[Vec3], positions: &[Vec3], tool: &ToolView) -> String {
    let camera = Camera::framing(rest, 0.35, 0.8, FRAME[0], FRAME[1]);
    let mut svg = String::with_capacity(200_000);
    head(&mut svg);
    shadow(&mut svg, &camera, rest);

    // The painter's algorithm: what is farther away first.
    let mut triangles = shade(triangles, rest, positions, |point| camera.towards(point));
    let depth = |triangle: &Shaded| {
        triangle.outline.iter().map(|point| camera.see(point).depth).sum::<f64>() / triangle.outline.len() as f64
    };
    triangles.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
    let tip = camera.see(&(tool.position + Vec3::z() * TIP_RADIUS));
    let in_front = triangles.partition_point(|triangle| depth(triangle) > tip.depth);
    paint(&mut svg, &camera, &triangles[..in_front]);
    draw_tool(&mut svg, &camera, tool, tip);
    paint(&mut svg, &camera, &triangles[in_front..]);
    arrow(&mut svg, &camera, tool);
    caption(&mut svg, &camera, tip, tool);
    svg + "</svg>\n"
}

/// Colours and lettering that shapes refer to.
const DEFINITIONS: &str = r##"<defs>
<radialGradient id="card" cx=".5" cy=".42" r=".8"><stop offset="0" stop-color="#2c3a4f"/><stop offset="1" stop-color="#131a26"/></radialGradient>
<radialGradient id="tip" cx=".36" cy=".3" r=".75"><stop offset="0" stop-color="#fff"/><stop offset=".35" stop-color="#b9c7da"/><stop offset="1" stop-color="#3c4a60"/></radialGradient>
<linearGradient id="handle" x1="0" x2="1" y1="0" y2=".35"><stop offset="0" stop-color="#e6edf7"/><stop offset=".5" stop-color="#9fb0c8"/><stop offset="1" stop-color="#4a5a74"/></linearGradient>
<filter id="soft" x="-30%" y="-60%" width="160%" height="220%"><feGaussianBlur stdDeviation="14"/></filter>
<style>.m{fill:none;stroke:#300;stroke-opacity:.16;stroke-width:8}text{font-family:Helvetica,Arial,sans-serif}.t{font-size:16px;fill:#c7d2e2}.b{font-size:24px;font-weight:bold}</style>
</defs>
"##;

/// The card, which makes the picture legible on any page.
fn head(svg: &mut String) {
    put(
        svg,
        format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             role=\"img\" aria-label=\"A liver, dented by a tool that drags across it, and the force on the tool\">\n\
             {DEFINITIONS}<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" rx=\"18\" fill=\"url(#card)\"/>\n"
        ),
    );
}

/// On the ground: an ellipse as wide as the body.
fn shadow(svg: &mut String, camera: &Camera, rest: &[Vec3]) {
    let (low, high) = rest.iter().fold((rest[0], rest[0]), |(a, b), point| (a.inf(point), b.sup(point)));
    let (middle, half) = ((low + high) / 2.0, (high - low) * 0.56);
    let around = (0..24).map(|n| std::f64::consts::TAU * f64::from(n) / 24.0);
    let points = around.map(|angle| Vec3::new(middle.x + half.x * angle.cos(), middle.y + half.y * angle.sin(), low.z));
    let path: Vec<String> = points.map(|point| camera.see(&point).at.map(|x| format!("{x:.0}")).join(" ")).collect();
    put(svg, format_args!("<path d=\"M{}z\" opacity=\".55\" filter=\"url(#soft)\"/>\n", path.join("L")));
}

/// Triangles in the given order, those pieces of one colour in one path, with the edges of the mesh over them.
fn paint(svg: &mut String, camera: &Camera, triangles: &[Shaded]) {
    svg.push_str("<g transform=\"scale(.1)\">\n");
    for triangle in triangles {
        for same in triangle.pieces.chunk_by(|(_, a), (_, b)| a == b) {
            let [r, g, b] = same[0].1;
            put(svg, format_args!("<path fill=\"#{r:02x}{g:02x}{b:02x}\" d=\""));
            for (corners, _) in same {
                outline(svg, &widened(corners.map(|corner| camera.see(&corner).at)));
            }
            svg.push_str("\"/>\n");
        }
        let seen: Vec<[f64; 2]> = triangle.outline.iter().map(|point| camera.see(point).at).collect();
        svg.push_str("<path class=\"m\" d=\"");
        outline(svg, &seen);
        svg.push_str("\"/>\n");
    }
    svg.push_str("</g>\n");
}

/// A closed path in tenths of a pixel, each corner relative to the one before.
fn outline(svg: &mut String, corners: &[[f64; 2]]) {
    let tenths = |corner: &[f64; 2]| corner.map(|x| (10.0 * x).round() as i32);
    let Some(mut last) = corners.first().map(tenths) else { return };
    put(svg, format_args!("M{} {}l", last[0], last[1]));
    for (n, corner) in corners[1..].iter().map(tenths).enumerate() {
        let space = if n == 0 { "" } else { " " };
        put(svg, format_args!("{space}{} {}", corner[0] - last[0], corner[1] - last[1]));
        last = corner;
    }
    svg.push('z');
}

/// Every edge moved outwards a little, so that no gap shows between neighbours: scaled about the centre of the incircle.
fn widened([a, b, c]: [[f64; 2]; 3]) -> [[f64; 2]; 3] {
    let length = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]).hypot(q[1] - p[1]);
    let opposite = [length(b, c), length(c, a), length(a, b)];
    let around: f64 = opposite.iter().sum();
    let area = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs() / 2.0;
    let scale = (1.0 + OVERLAP * around / (2.0 * area)).min(WIDEST);
    let centre: [f64; 2] =
        std::array::from_fn(|axis| (opposite[0] * a[axis] + opposite[1] * b[axis] + opposite[2] * c[axis]) / around);
    [a, b, c].map(|corner| std::array::from_fn(|axis| centre[axis] + scale * (corner[axis] - centre[axis])))
}

fn draw_tool(svg: &mut String, camera: &Camera, tool: &ToolView, tip: Seen) {
    let radius = TIP_RADIUS * camera.scale_at(tip.depth);
    let end = camera.see(&(tool.position + Vec3::z() * TIP_RADIUS + HANDLE));
    let ([x, y], [ex, ey]) = (tip.at, end.at);
    let (dx, dy) = (ex - x, ey - y);
    let length = dx.hypot(dy);
    let (nx, ny) = (-dy / length, dx / length);
    // A cone: thin at the tip, thicker at the hand's end.
    let (thin, thick) = (0.42 * radius, 0.85 * radius);
    put(
        svg,
        format_args!(
            "<path fill=\"url(#handle)\" d=\"M{:.1} {:.1}L{:.1} {:.1}A{thick:.1} {thick:.1} 0 0 1 {:.1} {:.1}L{:.1} {:.1}z\"/>\n\
             <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"url(#tip)\"/>\n",
            x - nx * thin,
            y - ny * thin,
            ex - nx * thick,
            ey - ny * thick,
            ex + nx * thick,
            ey + ny * thick,
            x + nx * thin,
            y + ny * thin,
        ),
    );
}

/// The force that the hand feels, from the tip's surface.
fn arrow(svg: &mut String, camera: &Camera, tool: &ToolView) {
    let newtons = tool.commanded_force.norm();
    if newtons < NO_FORCE {
        return;
    }
    let start = tool.position + Vec3::z() * TIP_RADIUS + tool.commanded_force * (TIP_RADIUS / newtons);
    let ([x, y], [ex, ey]) = (camera.see(&start).at, camera.see(&(start + tool.commanded_force * ARROW_PER_NEWTON)).at);
    let (dx, dy) = (ex - x, ey - y);
    let length = dx.hypot(dy).max(1e-9);
    let (ux, uy) = (dx / length, dy / length);
    let (head, half) = (18.0_f64.min(0.6 * length), 8.5);
    let (bx, by) = (ex - ux * head, ey - uy * head);
    put(
        svg,
        format_args!(
            "<path stroke=\"#ffd84d\" stroke-width=\"5\" stroke-linecap=\"round\" d=\"M{x:.1} {y:.1}L{bx:.1} {by:.1}\"/>\n\
             <path fill=\"#ffd84d\" d=\"M{ex:.1} {ey:.1}L{:.1} {:.1}L{:.1} {:.1}z\"/>\n\
             <text class=\"b\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#ffd84d\" stroke=\"#131a26\" stroke-width=\"3\" paint-order=\"stroke\">{newtons:.2} N</text>\n",
            bx - uy * half,
            by + ux * half,
            bx + uy * half,
            by - ux * half,
            ex + 14.0 * ux,
            ey - 14.0,
        ),
    );
}

fn caption(svg: &mut String, camera: &Camera, tip: Seen, tool: &ToolView) {
    let bar = 0.02 * camera.scale_at(tip.depth);
    let (left, right, base) = (WIDTH - 40.0 - bar, WIDTH - 40.0, HEIGHT - 50.0);
    let mode = format!("{:?}", tool.mode).to_lowercase();
    put(
        svg,
        format_args!(
            "<text class=\"b\" x=\"36\" y=\"48\" fill=\"#f4f7fb\">palpate</text>\n\
             <text class=\"t\" x=\"36\" y=\"74\">a liver of 3,390 tetrahedra,</text>\n\
             <text class=\"t\" x=\"36\" y=\"96\">simulated at 30 Hz and felt at 1 kHz</text>\n\
             <text class=\"t\" x=\"36\" y=\"{:.0}\">t = {:.2} s, contact: {mode}; arrow: force that the hand feels</text>\n\
             <path stroke=\"#c7d2e2\" stroke-width=\"2\" d=\"M{left:.1} {:.1}v8m0-4H{right:.1}m0-4v8\"/>\n\
             <text class=\"t\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">20 mm</text>\n",
            HEIGHT - 36.0,
            tool.time.as_secs_f64(),
            base - 4.0,
            (left + right) / 2.0,
            HEIGHT - 36.0 + 8.0,
        ),
    );
}

fn put(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    text.write_fmt(arguments).expect("a String takes every text");
}
