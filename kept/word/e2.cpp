#include <chrono>
#include "drv.hpp"
void setrate(Scene& s,const Structure& S,double per=0.4){s.rate=std::clamp(S.omega.maxCoeff()/per,20*lowest_of(S)/6.28,20000.0);}
std::string S(double x){char b[40];std::snprintf(b,40,"%.4g",x);return b;}
double size_of(const Structure& s){return s.mass_properties.r.colwise().norm().maxCoeff();}
Scene straight(int n,double k,double kb,unsigned seed){std::mt19937 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="s";
  for(int i=0;i<n;++i)point(s,std::exp(0.4*u(g)),Vector3d(i,0,0));
  for(int i=0;i+1<n;++i)link(s,{i,i+1},Spring{k});for(int i=0;i+2<n;++i)link(s,{i,i+1,i+2},BendingSpring{kb});publish_all(s);return s;}
// two tetrahedra at a hinge line, the hinge held softly
Scene hinged(double k_hinge){Scene s;s.name="hs";
    point(s,1,{0,0,0.1});point(s,1.2,{0,1,-0.1});point(s,1,{1,0.4,0.3});point(s,1.3,{-1,0.6,0.2});point(s,0.8,{1.1,0.7,-0.4});point(s,0.9,{-0.9,0.2,-0.5});
    auto j=[&](int a,int b){link(s,{a,b},Spring{1000.0+100*a+70*b});};
    j(0,1);for(int k:{2,3,4,5}){j(0,k);j(1,k);}j(2,4);j(3,5);if(k_hinge>0)link(s,{4,5},Spring{k_hinge});publish_all(s);return s;}
TEST(E,softhinge){for(double kh:{0.3,3.0,30.})for(double amp:{3e-4,1e-3,3e-3}){Scene s=hinged(kh);
    auto S_=st(s);setrate(s,*S_);double w1=lowest_of(*S_);int a=S_->mechanisms.size();
    add_mode(s,*S_,a+1,amp,0);add_mode(s,*S_,a+2,amp,0);
    study("softhinge kh "+S(kh)+" w1 "+S(w1)+" w2 "+S(S_->omega[a+1])+" amp "+S(amp),s,4*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled,Fidelity::kExactBars},30);}}
TEST(E,static_soft){for(double kh:{0.3,3.0,30.})for(double f:{0.1,1.0}){Scene s=hinged(kh);s.damping.modal_ratio=0.3;
    auto S_=st(s);setrate(s,*S_);double w1=lowest_of(*S_);
    // balanced loads within each tetrahedron: along its own edges, no work on the hinge
    Load L;L.axes=Axes::kBody;auto pair=[&](int a,int b,double F){Vector3d d=(s.points[b].position-s.points[a].position).normalized();L.forces.push_back({a,-F*d});L.forces.push_back({b,F*d});};
    pair(0,2,f);Load L2=L;L.forces.clear();pair(1,3,1.3*f);L.name="b";L2.name="a";Load L3;L3.name="c";L3.axes=Axes::kBody;L.forces.swap(L3.forces);pair(2,4,0.8*f);s.loads={L2,L3,L};
    study("static soft kh "+S(kh)+" w1 "+S(w1)+" f "+S(f),s,3*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled,Fidelity::kExactBars},25);}}
TEST(E,silly_pair){Scene s;s.name="p";point(s,1,{0,0,0});point(s,2,{1,0,0});link(s,{0,1},Spring{1000});publish_all(s);auto S_=st(s);setrate(s,*S_);
    for(double amp:{0.02,0.05,0.1}){Scene c=s;add_mode(c,*S_,0,amp,0);study("spring pair amp "+S(amp),c,10*2*M_PI/lowest_of(*S_),{Fidelity::kSeparated,Fidelity::kCoupled,Fidelity::kExactBars},25);}}
TEST(E,silly_hammer){for(double share:{1.5,3.})for(double dt:{0.003,0.01}){Scene s=straight(4,3e5,100,1);auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_,0.3);s.rate=std::round(s.rate);
    add_mode(s,*S_,0,1e-3,0);Load L;L.axes=Axes::kBody;double F=share*100*2;double d=dt/w1;L.forces={{0,Vector3d(F,0,0)},{3,Vector3d(-F,0,0)}};L.history=PulseHistory{std::round(1*s.rate)/s.rate,std::max(1.0,std::round(d*s.rate))/s.rate};s.loads={L};
    study("hammer share "+S(share)+" dt*w "+S(dt)+" rate "+S(s.rate),s,3*2*M_PI/w1,{Fidelity::kSeparated},400);}}
TEST(E,silly_fast){for(double share:{0.7,1.5})for(double r:{5.,8.}){Scene s=straight(3,1e6,100,1);auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_,0.3);s.rate=std::max(s.rate,80*r*w1/6.28);
    add_mode(s,*S_,0,1e-3,0);Load L;L.axes=Axes::kBody;double F=share*100*3;L.forces={{0,Vector3d(F,0,0)},{2,Vector3d(-F,0,0)}};L.history=SineHistory{r*w1/2/M_PI,0};s.loads={L};
    study("fast axial share "+S(share)+" r "+S(r),s,3*2*M_PI/w1,{Fidelity::kSeparated},40);}}
// random structures: springs, angles, a few bars, clustered stiff and soft, loads of every history
Scene wild(unsigned seed){std::mt19937_64 g(seed);auto u=[&](double a,double b){return std::uniform_real_distribution<double>(a,b)(g);};auto w=[&](int a,int b){return std::uniform_int_distribution<int>(a,b)(g);};auto dir=[&]{std::normal_distribution<double>n;return Vector3d(n(g),n(g),n(g)).normalized();};
  Scene s;s.name="w";int n=w(4,6);int kind=w(0,4);
  double flat=kind==1?0.05:kind==2?0.3:1;
  while((int)s.points.size()<n){Vector3d p(1.5*u(-1,1),0.8*flat*u(-1,1),0.6*flat*u(-1,1));if(kind<=1)p.x()=s.points.size();bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.4;if(ok)point(s,std::exp(u(-1.5,1.5)),p);}
  if(kind<=1){for(int i=0;i+1<n;++i)link(s,{i,i+1},Spring{std::exp(u(6,9))});for(int i=0;i+2<n;++i)link(s,{i,i+1,i+2},BendingSpring{std::exp(u(4,6))});if(kind==1)for(int i=0;i+3<n;++i)link(s,{i,i+1,i+2,i+3},TorsionSpring{std::exp(u(3,5))});}
  else for(int a=0;a<n;++a)for(int b=a+1;b<n;++b){if(kind==3&&a==0&&b==n-1)continue;link(s,{a,b},Spring{std::exp(kind==4?u(4,10):u(7,9))});}
  publish_all(s);return s;}
TEST(E,wild){unsigned first=getenv("FIRST")?atoi(getenv("FIRST")):0,last=getenv("LAST")?atoi(getenv("LAST")):40;
  for(unsigned seed=first;seed<last;++seed){Scene s=wild(seed);auto S_=st(s);if(!S_)continue;std::mt19937_64 g(seed+1000000);auto u=[&](double a,double b){return std::uniform_real_distribution<double>(a,b)(g);};auto w=[&](int a,int b){return std::uniform_int_distribution<int>(a,b)(g);};auto dir=[&]{std::normal_distribution<double>n;return Vector3d(n(g),n(g),n(g)).normalized();};
    setrate(s,*S_,0.5);double w1=lowest_of(*S_);if(S_->omega.maxCoeff()>40*w1)continue;double z=size_of(*S_),M=S_->mass_properties.mass;int a=S_->mechanisms.size(),nm=S_->omega.size();
    double amp=z*std::exp(u(std::log(1e-6),std::log(1e-3)));int rings=w(0,2);for(int k=0;k<rings;++k)add_mode(s,*S_,std::min(nm-1,a+w(0,3)),amp*u(-1,1),amp*w1*u(-1,1));
    int sp=w(0,2);if(sp)s.initial.angular_velocity=w1*std::exp(u(std::log(1e-3),std::log(0.1)))*dir();
    if(w(0,1))s.damping.modal_ratio=std::exp(u(std::log(1e-3),std::log(0.05)));
    int nl=w(0,2);std::string what;for(int k=0;k<nl;++k){Load L;L.name="L"+std::to_string(k);L.axes=w(0,1)?Axes::kBody:Axes::kWorld;double F=M*w1*w1*z*std::exp(u(std::log(1e-5),std::log(1e-2)));int p=w(0,(int)s.points.size()-1),q=w(0,(int)s.points.size()-1);
      if(w(0,1)&&p!=q){Vector3d d=(s.points[q].position-s.points[p].position).normalized();L.axes=Axes::kBody;L.forces={{p,F*d},{q,-F*d}};}else L.forces={{p,F*dir()}};
      int h=w(0,3);if(h==0){int x=a+w(0,2),y=a+w(0,3);x=std::min(x,nm-1);y=std::min(y,nm-1);double Om=w(0,2)?S_->omega[x]+S_->omega[y]:std::abs(S_->omega[x]-S_->omega[y])+0.01*w1;L.history=SineHistory{Om/2/M_PI,u(0,6)};}
      if(h==1)L.history=PulseHistory{u(0,5)/w1,u(1,60)/w1};if(h==2){TableHistory t;double x=0;for(int i=0;i<6;++i){t.times.push_back(x);t.values.push_back(u(-1,1));x+=u(2,20)/w1;}L.history=t;}
      s.loads.push_back(L);what+=" "+std::to_string(h)+(L.forces.size()==2?"pair":"");}
    std::vector<Fidelity> R={Fidelity::kSeparated};if(sp)R.push_back(Fidelity::kSpinLoaded);R.push_back(Fidelity::kCoupled);
    if(getenv("DUMP")){for(auto&p:s.points)std::printf("pt %.15g at %.15g %.15g %.15g\n",p.mass,p.position.x(),p.position.y(),p.position.z());for(auto&l:s.links){std::printf("link");for(int q:l.points)std::printf(" %d",q);if(auto*k=std::get_if<Spring>(&l.kind))std::printf(" spring %.15g\n",k->stiffness);else if(auto*k=std::get_if<BendingSpring>(&l.kind))std::printf(" bending %.15g\n",k->stiffness);else if(auto*k=std::get_if<TorsionSpring>(&l.kind))std::printf(" torsion %.15g\n",k->stiffness);}for(auto&L:s.loads)for(auto&x:L.forces)std::printf("load axes %d hist %zu pt %d %.15g %.15g %.15g\n",(int)L.axes,L.history.index(),x.point,x.force.x(),x.force.y(),x.force.z());std::printf("damping %g rate %g w ",s.damping.modal_ratio,s.rate);for(int q=0;q<S_->omega.size();++q)std::printf("%.4g ",S_->omega[q]);std::printf("\n");}
    study("wild "+std::to_string(seed)+" mech"+std::to_string(a)+" rings"+std::to_string(rings)+" spin"+S(s.initial.angular_velocity.norm()/w1)+" amp/z"+S(amp/z)+" loads"+what,s,std::exp(u(std::log(10),std::log(120)))*2*M_PI/w1,R,20);}}
TEST(Z,tally){std::printf("TALLY scenes %d runs %d runs with false %d words %d good %d false %d silly runs %d\n",tally.scenes,tally.runs,tally.runs_fg,tally.words,tally.good,tally.false_good,tally.silly);}
