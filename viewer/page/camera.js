// Where the picture is taken from.

import { Box3, MathUtils, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** By name: from where, in lengths of the robot but for one longer than `most` m, and how far behind its
 * front one looks at most, likewise. */
const VIEWS = [
    { name: "head", from: [0.5, -0.46, 0.34], near: [0.9, -0.7, 0.55], behind: 0.32, most: 2.4 },
    { name: "whole", from: [0.36, -0.86, 0.6], near: [0.6, -1.1, 0.8], behind: Infinity, most: Infinity },
    { name: "side", from: [0, -1.15, 0.16], near: [0, -1.7, 0.35], behind: Infinity, most: Infinity },
    { name: "above", from: [0, -0.001, 1.25], near: [0, -0.001, 2], behind: Infinity, most: Infinity },
];

export class Camera {
    constructor(camera, canvas, changed) {
        this.camera = camera;
        this.controls = new OrbitControls(camera, canvas);
        Object.assign(this.controls, {
            enableDamping: false,
            minDistance: 0.12,
            maxDistance: 400,
            maxPolarAngle: 1.62,
        });
        this.controls.addEventListener("change", changed);
        this.follows = true;
        this.view = 0;
        this.last = null;
    }

    /** Takes up the view of this name, or the next one. */
    show(run, time, name) {
        const found = VIEWS.findIndex((view) => view.name === name);
        this.view = found >= 0 ? found : (this.view + 1) % VIEWS.length;
        const { from, near, behind, most } = VIEWS[this.view];
        const box = bounds(run, time);
        const size = box.getSize(new Vector3());
        const length = Math.max(size.x, size.y, 0.36);
        const short = MathUtils.clamp((1.6 - length) / 1.1, 0, 1);
        // Upright windows see less from side to side.
        const wide = Math.max(1, 1.25 / this.camera.aspect);
        const distance = Math.min(length, most) * wide;
        const target = box.getCenter(new Vector3());
        target.x = Math.max(target.x, box.max.x - behind * distance);
        const offset = new Vector3(...from).lerp(new Vector3(...near), short).multiplyScalar(distance);
        this.camera.position.copy(target).add(offset);
        this.controls.target.copy(target);
        this.controls.update();
        this.last = null;
        return VIEWS[this.view].name;
    }

    /** Goes along with a module, or with the middle of the robot. */
    follow(run, time, selected) {
        const at = selected === null ? middle(run, time) : run.place(selected, time);
        if (this.follows && this.last) {
            const way = at.clone().sub(this.last);
            if (selected === null) way.z = 0;
            this.camera.position.add(way);
            this.controls.target.add(way);
            this.controls.update();
        }
        this.last = at;
    }

    /** Looks at a module from where the camera is, nearer if it is far. */
    lookAt(place) {
        const offset = this.camera.position.clone().sub(this.controls.target);
        this.controls.target.copy(place);
        this.camera.position.copy(place).add(offset.setLength(Math.min(offset.length(), 1.6)));
        this.controls.update();
        this.last = null;
    }
}

function bounds(run, time) {
    const box = new Box3();
    for (let module = 0; module < run.modules; module++) box.expandByPoint(run.place(module, time));
    return box.expandByScalar(0.09);
}

function middle(run, time) {
    const sum = new Vector3();
    for (let module = 0; module < run.modules; module++) sum.add(run.place(module, time));
    return sum.divideScalar(run.modules);
}
