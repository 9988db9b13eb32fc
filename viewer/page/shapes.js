// What parts of a module look like: a yoke with docks turns about the hub of the part at the roll.
// The physical world has plain boxes in their places.

import { BoxGeometry, BufferAttribute, Color, CylinderGeometry, ExtrudeGeometry, Shape } from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";

const SHELL = 0.041;
const PLATE = 0.011;
const BEVEL = 0.0015;

/** A geometry all of one colour, which the colour of an instance tints. */
function painted(geometry, grey) {
    const plain = geometry.index ? geometry.toNonIndexed() : geometry;
    const colour = new Color(grey, grey, grey);
    const colours = new Float32Array(plain.attributes.position.count * 3);
    for (let at = 0; at < colours.length; at += 3) colour.toArray(colours, at);
    plain.setAttribute("color", new BufferAttribute(colours, 3));
    plain.deleteAttribute("uv");
    return plain;
}

/** A plate in the plane of x and z: square towards `reach` along x, and round about the joint. */
function rounded(reach, radius, thickness, y) {
    const shape = new Shape();
    shape.moveTo(reach, -radius);
    shape.lineTo(0, -radius);
    shape.absarc(0, 0, radius, -Math.PI / 2, Math.PI / 2, reach > 0);
    shape.lineTo(reach, radius);
    shape.closePath();
    const settings = {
        depth: thickness - 2 * BEVEL,
        bevelThickness: BEVEL,
        bevelSize: BEVEL,
        bevelOffset: -BEVEL,
    };
    const geometry = new ExtrudeGeometry(shape, { ...settings, bevelSegments: 1, curveSegments: 14 });
    // Extruded along z: bring that to y.
    return geometry.rotateX(Math.PI / 2).translate(0, y + thickness / 2 - BEVEL, 0);
}

function disc(radius, thickness, axis) {
    const geometry = new CylinderGeometry(radius, radius, thickness, 24);
    if (axis === "x") geometry.rotateZ(Math.PI / 2);
    if (axis === "z") geometry.rotateX(Math.PI / 2);
    return geometry;
}

/** A dock's face: a dark plate with four bright sockets. */
function face(axis, sign) {
    const at = [..."xyz"].map((its) => (its === axis ? sign * SHELL : 0));
    const plate = painted(disc(0.021, 0.0025, axis).translate(...at), 0.16);
    const middle = painted(disc(0.007, 0.0034, axis).translate(...at), 0.75);
    return [plate, middle];
}

/** The half with the Front dock, Left and Right; or that with Back, Up and Down. */
export function yoke(isFront) {
    const sign = isFront ? 1 : -1;
    const plates = [SHELL - PLATE / 2, PLATE / 2 - SHELL].map((y) =>
        painted(rounded(sign * SHELL, SHELL, PLATE, y), 1),
    );
    const wall = new BoxGeometry(0.016, 2 * SHELL - 0.002, 2 * SHELL - 0.002).translate(
        sign * (SHELL - 0.008),
        0,
        0,
    );
    const sides = isFront
        ? [
              ["y", 1],
              ["y", -1],
          ]
        : [
              ["z", 1],
              ["z", -1],
          ];
    const faces = [["x", sign], ...sides].flatMap(([axis, side]) => face(axis, side));
    // Docks at the top and at the bottom need something to sit on.
    const bridges = isFront
        ? []
        : [1, -1].map((side) =>
              painted(
                  new BoxGeometry(0.03, 2 * SHELL - 0.004, 0.004).translate(0, 0, side * (SHELL - 0.003)),
                  1,
              ),
          );
    return mergeGeometries([...plates, painted(wall, 0.94), ...faces, ...bridges]);
}

/** The part at the roll, which goes from the joint to the middle of the module. */
export function hub(isFront) {
    const sign = isFront ? -1 : 1;
    const inside = 2 * (SHELL - PLATE) - 0.003;
    const block = rounded(sign * 0.03, 0.036, inside, 0);
    const ring = disc(0.0385, 0.014, "x").translate(sign * 0.034, 0, 0);
    const seam = disc(0.0392, 0.003, "x").translate(sign * 0.0405, 0, 0);
    return mergeGeometries([painted(block, 0.8), painted(ring, 0.55), painted(seam, 1.6)]);
}

/** Half a cube on one side of its joint, as the physical world has it. */
export const box = (sign) =>
    painted(new BoxGeometry(SHELL, 2 * SHELL, 2 * SHELL).translate((sign * SHELL) / 2, 0, 0), 1);

/** What is drawn between two docks that hold each other: a frame round both, in the plane of y and z. */
export const joint = () => new BoxGeometry(0.0036, 2 * SHELL + 0.003, 2 * SHELL + 0.003);
