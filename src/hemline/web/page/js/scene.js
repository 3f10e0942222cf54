// The picture: body, garment, floor, light, and a camera that follows the body.

import * as THREE from "three";
import { OrbitControls } from "three/OrbitControls.js";

const SKIN = 0xb9a99c, CLOTHS = [0x9c2f2a, 0x2f5d7c, 0x4f6b3a, 0x7a5a8c, 0xb07a2a], GROUND = 0xe9e7e2;

export class Scene {
  constructor(canvas) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(GROUND);
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.05, 50);
    this.camera.position.set(1.7, 1.4, -3.6);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0, 0.95, 0);
    this.controls.maxPolarAngle = 1.65;
    this.controls.minDistance = 0.5;
    this.controls.maxDistance = 15;
    this.stale = true;
    this.controls.addEventListener("change", () => (this.stale = true));
    this.#light();
    this.place = new THREE.Vector3();
    this.cloths = new Map();
  }

  /** Updates the picture from a stage. */
  show(stage) {
    this.skin ??= this.#mesh(stage.body.vertices, stage.body.normals, stage.body.faces, SKIN, true);
    if (!this.cloths.has(stage.player)) {
      const { vertices, normals, faces } = stage.player;
      this.cloths.set(stage.player, this.#mesh(vertices, normals, faces, CLOTHS[this.cloths.size % CLOTHS.length], false));
    }
    for (const [player, mesh] of this.cloths) mesh.visible = player === stage.player;
    for (const mesh of [this.skin, this.cloths.get(stage.player)]) {
      mesh.geometry.attributes.position.needsUpdate = mesh.geometry.attributes.normal.needsUpdate = true;
    }
    this.#follow(stage.body.joints);
    this.stale = true;
  }

  /** Draws if anything has changed. */
  draw() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement;
    const ratio = this.renderer.getPixelRatio(), canvas = this.renderer.domElement;
    if (canvas.width !== Math.floor(width * ratio) || canvas.height !== Math.floor(height * ratio)) {
      this.renderer.setSize(width, height, false);
      this.#frame(width, height);
      this.stale = true;
    }
    this.controls.update();
    if (this.stale) this.renderer.render(this.scene, this.camera);
    this.stale = false;
  }

  /** Centres the picture above the panel; a narrow window shows as much as a square one. */
  #frame(width, height) {
    const panel = Math.min(document.getElementById("panel").offsetHeight, 0.3 * height), free = height - panel;
    this.camera.aspect = width / free;
    this.camera.zoom = Math.min(1, 1.6 * this.camera.aspect);
    this.camera.setViewOffset(width, free, 0, 0, width, height);
  }

  /** Moves camera and light with the pelvis over the floor. */
  #follow(joints) {
    const step = new THREE.Vector3(joints[0], 0, joints[2]).sub(this.place);
    this.place.add(step);
    for (const each of [this.camera.position, this.controls.target, this.sun.position, this.sun.target.position]) each.add(step);
    this.floor.position.set(Math.round(this.place.x), 0, Math.round(this.place.z)); // by whole squares, so that it seems to stand still
  }

  #mesh(vertices, normals, faces, color, behind) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(vertices, 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(faces), 1));
    const material = new THREE.MeshStandardMaterial({ color, roughness: 0.85, side: THREE.DoubleSide });
    // draw skin that is slightly above the cloth behind it
    if (behind) Object.assign(material, { side: THREE.FrontSide, polygonOffset: true, polygonOffsetFactor: 1.5, polygonOffsetUnits: 60 });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    mesh.castShadow = mesh.receiveShadow = true;
    this.scene.add(mesh);
    return mesh;
  }

  #light() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xb8b0a4, 1.6));
    this.sun = new THREE.DirectionalLight(0xfff4e6, 2.2);
    this.sun.position.set(2, 4, -2.5);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    Object.assign(this.sun.shadow.camera, { left: -1.6, right: 1.6, top: 2.2, bottom: -1.6, near: 0.5, far: 10 });
    this.sun.shadow.normalBias = 0.02;
    this.scene.add(this.sun, this.sun.target);
    this.floor = new THREE.Group();
    const ground = new THREE.Mesh(new THREE.CircleGeometry(40, 48), new THREE.ShadowMaterial({ opacity: 0.25 }));
    ground.rotation.x = -Math.PI / 2;
    ground.receiveShadow = true;
    const grid = new THREE.GridHelper(40, 40, 0xc9c5bd, 0xd8d4cc);
    grid.position.y = -0.002;
    this.floor.add(ground, grid);
    this.scene.add(this.floor);
  }
}
