// What the robot moves on.

import {
    BoxGeometry,
    CanvasTexture,
    Group,
    LineBasicMaterial,
    LineSegments,
    EdgesGeometry,
    Mesh,
    MeshStandardMaterial,
    PlaneGeometry,
    RepeatWrapping,
    SRGBColorSpace,
} from "three";

/** How far it is drawn, in m each way. */
const REACH = 60;
const WIDTH = 50;

/** Squares of a metre with lines each 10 cm. */
function squares({ ground, line, strong }) {
    const side = 512;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = side;
    const context = canvas.getContext("2d");
    context.fillStyle = ground;
    context.fillRect(0, 0, side, side);
    context.fillStyle = line;
    for (let at = 1; at < 10; at++) {
        context.fillRect(Math.round((at * side) / 10), 0, 1, side);
        context.fillRect(0, Math.round((at * side) / 10), side, 1);
    }
    context.fillStyle = strong;
    context.fillRect(0, 0, 2, side);
    context.fillRect(0, 0, side, 2);
    const texture = new CanvasTexture(canvas);
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.repeat.set(2 * REACH, 2 * REACH);
    texture.anisotropy = 8;
    texture.colorSpace = SRGBColorSpace;
    return texture;
}

/** The boxes that stand on the ground: middle, edges and turn about z. In m and degrees. */
export function boxes({ stair, blocks }) {
    const standing = blocks.map(({ at: [x, y], size, turn }) => ({ at: [x, y, size[2] / 2], size, turn }));
    if (!stair) return standing;
    const { from, height, length, number } = stair;
    for (let step = 0; step < number; step++) {
        const along = (number - step) * length;
        const at = [from + step * length + along / 2, 0, (step + 0.5) * height];
        standing.push({ at, size: [along, WIDTH, height], turn: 0 });
    }
    return standing;
}

/** The ground of a world; without one nothing but a grid to see by. */
export function ground(world, theme) {
    const group = new Group();
    const material = new MeshStandardMaterial({ map: squares(theme), roughness: 0.95, metalness: 0 });
    const plane = new Mesh(new PlaneGeometry(2 * REACH, 2 * REACH), material);
    plane.receiveShadow = true;
    group.add(plane);
    if (!world) {
        // Nothing bears the robot: what is drawn lies well below it.
        plane.position.z = -0.25;
        return group;
    }
    const block = new MeshStandardMaterial({ color: theme.block, roughness: 0.8 });
    const edge = new LineBasicMaterial({ color: theme.strong });
    for (const { at, size, turn } of boxes(world)) {
        const geometry = new BoxGeometry(...size);
        const box = new Mesh(geometry, block);
        box.position.set(...at);
        box.rotation.z = (turn * Math.PI) / 180;
        box.castShadow = box.receiveShadow = true;
        box.add(new LineSegments(new EdgesGeometry(geometry), edge));
        group.add(box);
    }
    return group;
}
