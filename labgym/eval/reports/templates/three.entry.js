// The parts of three.js that the pages use, as the global THREE; docs/viewer.md has the command that bundles them into three.min.js.

export {
  BufferAttribute, BufferGeometry, CircleGeometry, Color, CylinderGeometry, DirectionalLight, DoubleSide, Group, HemisphereLight,
  Mesh, MeshBasicMaterial, MeshLambertMaterial, NeutralToneMapping, PCFShadowMap, PerspectiveCamera, PMREMGenerator, Points, PointsMaterial, RingGeometry,
  Scene, Vector3, WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
export { RoomEnvironment } from 'three/examples/jsm/environments/RoomEnvironment.js';
export { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
export { mergeGeometries } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
