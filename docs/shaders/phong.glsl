// The chapters' model (8.10): what the built-in heuristic `phong` computes.

vec3 shade(Point point) {
    Material material = point.material;
    vec3 value = material.k_i + point.ambient * material.k_a;
    for (int i = 0; i < point.lights.length(); ++i) {
        Light light = point.lights[i];
        float cosine = dot(point.normal, light.toward);
        if (cosine > 0.0) {
            vec3 mirrored = 2.0 * cosine * point.normal - light.toward;
            float lobe = pow(max(dot(mirrored, point.view), 0.0), material.n);
            value += light.diffuse_intensity * material.k_d * cosine;
            value += light.specular_intensity * material.k_s * lobe;
        }
    }
    return value;
}
