// The picture: modules, what passes between them, and the ground.

import {
    BackSide,
    Color,
    DirectionalLight,
    Fog,
    Group,
    HemisphereLight,
    InstancedMesh,
    Matrix4,
    Mesh,
    MeshBasicMaterial,
    MeshStandardMaterial,
    PerspectiveCamera,
    Quaternion,
    Raycaster,
    Scene,
    SphereGeometry,
    Vector2,
    Vector3,
    WebGLRenderer,
    NeutralToneMapping,
    DynamicDrawUsage,
    PCFShadowMap,
} from "three";
import { Camera } from "./camera.js";
import { THEMES, ofLetter, ofType } from "./colours.js";
import { dock, parts, turn } from "./geometry.js";
import { ground } from "./ground.js";
import { box, hub, joint, yoke } from "./shapes.js";

/** For how long a hormone is seen where it came to, and a lost frame where it left, in s of who looks. */
const LINGER = 0.22;
/** The spheres of a hormone, with those that trail behind it. */
const TRAIL = 5;
const MOST_HORMONES = 4000;
/** Of more modules each is four plain boxes. */
const MOST_DETAILED = 400;

export class Picture {
    /** `isSmooth` says whether edges are smoothed: else where that costs little. */
    constructor(canvas, run, changed, isSmooth = hasGpu()) {
        this.run = run;
        this.renderer = new WebGLRenderer({ canvas, antialias: isSmooth, preserveDrawingBuffer: true });
        this.renderer.toneMapping = NeutralToneMapping;
        this.renderer.shadowMap.enabled = true;
        this.renderer.shadowMap.type = PCFShadowMap;
        this.scene = new Scene();
        this.camera = new PerspectiveCamera(38, 1, 0.02, 500);
        this.camera.up.set(0, 0, 1);
        this.view = new Camera(this.camera, canvas, changed);
        // A slope turns all: the world itself keeps its ground level and turns gravity.
        this.world = new Group();
        this.world.rotation.y = -((run.about.ground?.slope ?? 0) * Math.PI) / 180;
        this.scene.add(this.world);
        this.addLights();
        this.addModules();
        this.addMarks();
        this.places = Array.from({ length: run.modules }, () => ({
            frame: new Matrix4(),
            angles: [0, 0, 0],
        }));
        this.frames = Array.from({ length: run.modules }, () =>
            Array.from({ length: 4 }, () => new Matrix4()),
        );
    }

    addLights() {
        this.sky = new HemisphereLight("#ffffff", "#5a6472", 1);
        this.sky.position.set(0, 0, 1);
        this.sun = new DirectionalLight("#fff4e2", 2);
        this.sun.castShadow = true;
        this.sun.shadow.mapSize.set(2048, 2048);
        this.sun.shadow.bias = -0.0004;
        this.sun.shadow.normalBias = 0.004;
        this.scene.add(this.sky, this.sun, this.sun.target);
    }

    addModules() {
        const metal = new MeshStandardMaterial({ vertexColors: true, roughness: 0.42, metalness: 0.12 });
        const hubs = new MeshStandardMaterial({ vertexColors: true, roughness: 0.5, metalness: 0.35 });
        const isPlain = this.run.modules > MOST_DETAILED;
        const geometries = isPlain
            ? [box(-1), box(1), box(1), box(-1)]
            : [hub(true), hub(false), yoke(true), yoke(false)];
        const shapes = geometries.map((geometry, part) => [geometry, part < 2 ? hubs : metal]);
        this.hubs = hubs;
        this.meshes = shapes.map(([geometry, material]) => {
            const mesh = new InstancedMesh(geometry, material, this.run.modules);
            mesh.instanceMatrix.setUsage(DynamicDrawUsage);
            mesh.castShadow = mesh.receiveShadow = true;
            mesh.frustumCulled = false;
            this.world.add(mesh);
            return mesh;
        });
        const outline = new MeshBasicMaterial({ side: BackSide });
        this.outline = shapes.slice(2).map(([geometry]) => new Mesh(geometry, outline));
        for (const mesh of this.outline) {
            mesh.matrixAutoUpdate = mesh.visible = false;
            this.world.add(mesh);
        }
    }

    addMarks() {
        this.links = this.marks(joint(), new MeshBasicMaterial(), 3 * this.run.modules + 6);
        const glow = new MeshBasicMaterial({ toneMapped: false });
        this.pulses = this.marks(new SphereGeometry(1, 12, 8), glow, MOST_HORMONES);
    }

    marks(geometry, material, most) {
        const mesh = new InstancedMesh(geometry, material, most);
        mesh.instanceMatrix.setUsage(DynamicDrawUsage);
        mesh.frustumCulled = false;
        mesh.count = 0;
        this.world.add(mesh);
        return mesh;
    }

    setTheme(name) {
        const theme = (this.theme = THEMES[name]);
        this.scene.background = new Color(theme.sky);
        this.scene.fog = new Fog(theme.sky, 6, 26);
        this.sky.intensity = theme.fill;
        this.sun.intensity = theme.sun;
        this.hubs.color.set(theme.hub);
        this.outline[0].material.color.set(theme.path);
        if (this.floor) forget(this.world, this.floor);
        this.floor = ground(this.run.about.ground, theme);
        this.world.add(this.floor);
    }

    /** Fits it to the canvas, of which so many pixels at the right and at the bottom can't be seen. */
    resize(width, height, right, bottom) {
        this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.setViewOffset(width, height, right / 3, bottom / 3, width, height);
    }

    /** Draws the run at a time, which passes at `pace` seconds a second. */
    draw(time, pace, selected) {
        this.place(time, selected);
        this.tint(time, pace);
        this.join(time, pace);
        this.send(time, pace);
        this.light();
        this.renderer.render(this.scene, this.camera);
    }

    place(time, selected) {
        for (let module = 0; module < this.run.modules; module++) {
            parts(this.run.placing(module, time, this.places[module]), this.frames[module]);
            this.meshes.forEach((mesh, part) => mesh.setMatrixAt(module, this.frames[module][part]));
        }
        for (const mesh of this.meshes) mesh.instanceMatrix.needsUpdate = true;
        this.outline.forEach((mesh, index) => {
            mesh.visible = selected !== null;
            if (mesh.visible) mesh.matrix.copy(this.frames[selected][2 + index]).scale(OUTLINE);
        });
        this.world.updateMatrixWorld();
    }

    /** A module has the colour of its type, brighter while a hormone has just come. */
    tint(time, pace) {
        for (let module = 0; module < this.run.modules; module++) {
            COLOUR.set(ofType(this.run.type(module, time)));
            const came = this.run.arrived(module, time);
            if (came) {
                const share = 1 - (time - came.arrived) / (LINGER * pace);
                if (share > 0) COLOUR.lerp(GLOW.set(ofLetter(came.letter)), 0.28 * share);
            }
            this.meshes[2].setColorAt(module, COLOUR);
            this.meshes[3].setColorAt(module, COLOUR);
        }
        this.meshes[2].instanceColor.needsUpdate = this.meshes[3].instanceColor.needsUpdate = true;
    }

    /** Marks docks that hold each other: green where both have found the other, red where frames were lost. */
    join(time, pace) {
        const losing = new Set();
        for (const { from } of this.run.lost(time, LINGER * pace)) losing.add(6 * from.module + from.dock);
        let count = 0;
        for (const [one, its, other, others] of this.run.wiring(time).pairs) {
            const knows = (this.run.known(one, time) >> its) & (this.run.known(other, time) >> others) & 1;
            const isLosing = losing.has(6 * one + its) || losing.has(6 * other + others);
            dock(its, this.frames[one], PLACE)
                .add(dock(others, this.frames[other], THERE))
                .multiplyScalar(0.5);
            turn(its, this.frames[one], TURN);
            SIZE.setScalar(isLosing ? 1.12 : 1);
            this.links.setMatrixAt(count, MATRIX.compose(PLACE, TURN, SIZE));
            COLOUR.set(isLosing ? this.theme.lost : knows ? this.theme.held : this.theme.unknown);
            this.links.setColorAt(count++, COLOUR);
        }
        this.finish(this.links, count);
        this.losing = losing.size;
    }

    /** Hormones, from the middle of a module through its dock to the middle of the next. */
    send(time, pace) {
        let count = 0;
        this.travelling = 0;
        for (const passage of this.run.underWay(time, LINGER * pace)) {
            const { from, to, sent, arrived, letter, isLost } = passage;
            // One that did not come goes no further than its dock.
            const takes = arrived === null ? 0.004 : Math.max(arrived - sent, 1e-6);
            const share = (time - sent) / takes;
            const fade = 1 - Math.max(0, time - sent - takes) / (LINGER * pace);
            if (fade <= 0 || !to || count + TRAIL > MOST_HORMONES) continue;
            this.travelling++;
            const start = START.setFromMatrixPosition(this.places[from.module].frame);
            const door = dock(from.dock, this.frames[from.module], DOOR);
            const end = END.setFromMatrixPosition(this.places[to.module].frame);
            COLOUR.set(isLost ? this.theme.lost : ofLetter(letter));
            for (let behind = 0; behind < TRAIL; behind++) {
                const along = Math.min(share, 1) - 0.09 * behind * fade;
                if (along < 0) break;
                if (arrived === null) PLACE.lerpVectors(start, door, along);
                else if (along < 0.5) PLACE.lerpVectors(start, door, 2 * along);
                else PLACE.lerpVectors(door, end, 2 * along - 1);
                PLACE.z += 0.058;
                SIZE.setScalar(0.017 * (1 - 0.16 * behind) * (0.35 + 0.65 * fade));
                this.pulses.setMatrixAt(count, MATRIX.compose(PLACE, UNTURNED, SIZE));
                this.pulses.setColorAt(count++, GLOW.copy(COLOUR).multiplyScalar(1 - 0.15 * behind));
            }
        }
        this.finish(this.pulses, count);
    }

    finish(mesh, count) {
        mesh.count = count;
        mesh.instanceMatrix.needsUpdate = true;
        if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }

    /** The sun's shadows reach as far as one looks. */
    light() {
        const { target } = this.view.controls;
        const reach = Math.min(Math.max(this.camera.position.distanceTo(target) * 1.3, 0.8), 9);
        this.sun.position.copy(target).add(THERE.set(-0.35, -0.75, 1.15).multiplyScalar(2 * reach));
        this.sun.target.position.copy(target);
        const { camera } = this.sun.shadow;
        Object.assign(camera, {
            left: -reach,
            right: reach,
            top: reach,
            bottom: -reach,
            near: 0.05,
            far: 6 * reach,
        });
        camera.updateProjectionMatrix();
        Object.assign(this.scene.fog, { near: 3 * reach, far: 12 * reach });
    }

    /** The module at a place of the canvas, in pixels of the page. */
    pick(x, y, width, height) {
        RAY.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), this.camera);
        for (const mesh of this.meshes) mesh.computeBoundingSphere();
        return RAY.intersectObjects(this.meshes, false)[0]?.instanceId ?? null;
    }

    /** Where a module is on the canvas, in parts of its width and height; null behind the camera. */
    onScreen(module, rise = 0) {
        PLACE.setFromMatrixPosition(this.places[module].frame);
        PLACE.z += rise;
        PLACE.applyMatrix4(this.world.matrixWorld).project(this.camera);
        return PLACE.z > 1 ? null : [(PLACE.x + 1) / 2, (1 - PLACE.y) / 2];
    }

    /** How far apart docks are drawn that hold each other, at most, in mm. */
    dockError(time) {
        let most = 0;
        for (const [one, its, other, others] of this.run.wiring(time).pairs) {
            const place = dock(its, this.frames[one], PLACE);
            most = Math.max(most, place.distanceTo(dock(others, this.frames[other], THERE)));
        }
        return 1000 * most;
    }
}

/** Takes something away for good. */
function forget(world, group) {
    world.remove(group);
    group.traverse(({ geometry, material }) => {
        geometry?.dispose();
        material?.map?.dispose();
        material?.dispose();
    });
}

/** Whether more than a program draws. */
function hasGpu() {
    const context = document.createElement("canvas").getContext("webgl2");
    const names = context?.getExtension("WEBGL_debug_renderer_info");
    return !/SwiftShader|llvmpipe|software/i.test(
        names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "",
    );
}

const OUTLINE = new Vector3(1.07, 1.07, 1.07);
const UNTURNED = new Quaternion();
const RAY = new Raycaster();
const [COLOUR, GLOW] = [new Color(), new Color()];
const [PLACE, THERE, SIZE, START, DOOR, END] = Array.from({ length: 6 }, () => new Vector3());
const [MATRIX, TURN] = [new Matrix4(), new Quaternion()];
